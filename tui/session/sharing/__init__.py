"""Drives of a shared line: the program responsible for a motor whose own program has ended."""
