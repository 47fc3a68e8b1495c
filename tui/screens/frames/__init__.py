"""Frames: the traffic on the line."""
