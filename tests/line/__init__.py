"""End to end: our programs and other people's, over real lines."""
