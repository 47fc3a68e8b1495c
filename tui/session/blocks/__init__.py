"""Setting up indirect blocks and scanners, and exchanging through them."""
