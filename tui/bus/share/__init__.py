"""A line that several programs share: who owns it, how the others attach, what all must know."""
