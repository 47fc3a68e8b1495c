"""Opening a line and finding out who is on it."""
