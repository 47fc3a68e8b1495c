"""Self-test of a profile on the drive that is simulated from it."""
