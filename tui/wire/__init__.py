"""Frames, checksums and times of the protocol. Pure functions."""
