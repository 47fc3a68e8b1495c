"""A line that several programs share: its owner, attaching to it, and their common state."""
