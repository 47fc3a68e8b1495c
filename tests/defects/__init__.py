"""Defects that the tests must notice, by the part of the panel that they are planted in."""
