"""Defects that the tests must notice, by area of the panel."""
