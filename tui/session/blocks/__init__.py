"""Configuration of indirect blocks and scanners, and exchanges through them."""
