"""The general sentence on a fault reset; help needs it before any profile is loaded."""

MAY_START = "A run command that is still present may start the motor."
"""The effect of a reset, for help and for a drive whose command channel is not known."""
