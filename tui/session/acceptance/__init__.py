"""Acceptance test of a drive: steps in a file, carried out on its motor, with limits."""
