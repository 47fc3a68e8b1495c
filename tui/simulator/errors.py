"""Errors of the simulated line, in words for the person who set it up."""


class SimulatorError(Exception):
    """A simulated drive or line cannot be set up as asked; the text says what to change."""
