"""What a person changes in a drive: edits, parameter sets, comparison, what may be written."""
