"""Watching a drive: the running monitor, feeding timeouts, the record of a trip."""
