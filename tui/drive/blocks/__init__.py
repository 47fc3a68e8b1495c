"""What indirect blocks and scanners bring: assignments, their cost on the wire, their file."""
