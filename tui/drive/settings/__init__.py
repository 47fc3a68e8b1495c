"""Settings of a drive: edits, parameter sets, comparison, write permissions."""
