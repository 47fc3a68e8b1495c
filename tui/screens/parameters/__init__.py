"""Parameters: the list, staging, writing, sets."""
