"""Errors of the simulated line, worded for the user who set it up."""


class SimulatorError(Exception):
    """A simulated drive or line cannot be set up as requested; the text says what to change."""
