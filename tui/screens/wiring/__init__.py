"""Wiring: what a person has to know of a family around its line."""
