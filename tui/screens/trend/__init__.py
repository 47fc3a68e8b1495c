"""Trend: values of up to four parameters over time."""
