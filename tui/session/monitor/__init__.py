"""Watching a drive: the running monitor, feeding time-outs, the record of a trip."""
