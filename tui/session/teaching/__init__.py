"""Learned scales of one drive: stored by drive, and used with its profile."""
