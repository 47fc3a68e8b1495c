"""Listening to a line on which others talk: which drives, which values, how well it goes."""
