"""Indirect blocks and scanners: assignments, their cost on the wire, their file."""
