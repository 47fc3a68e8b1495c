"""Comparison of this program's frame counts with those of a drive."""
