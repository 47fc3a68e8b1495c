"""Measurements of the panel beside its peers and the physical limit of its line."""
