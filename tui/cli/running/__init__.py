"""A motor that runs as long as a command does: its end, the reports on it, its stop."""
