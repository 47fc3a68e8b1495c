"""Frames: what goes over the line."""
