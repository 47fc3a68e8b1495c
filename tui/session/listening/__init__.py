"""Monitoring of a line with another master: its drives, their values, and the quality of
polling."""
