"""Faults: what the drive tripped on, and what it stored."""
