"""Start-up: the steps of a commissioning, one by one, with their results."""
