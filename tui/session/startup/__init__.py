"""Guided start-up of a drive: steps from a file, their results on disk."""
