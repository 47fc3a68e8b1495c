"""Faults screen: the drive's faults with their causes, checks and stored values."""
