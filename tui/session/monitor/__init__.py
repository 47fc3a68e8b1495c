"""Monitoring of drives: cyclic polls, communication timeouts, faults and trip records."""
