"""Diagnosis of a drive that does not answer: evidence from its line, and the first failing
check."""
