"""Monitor: the motor as it is, and the line that runs it."""
