"""Indirect blocks and scanners: assignments, their time on the wire, their file."""
