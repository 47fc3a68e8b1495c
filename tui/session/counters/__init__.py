"""Exchanges with a drive, counted by this program and by the drive."""
