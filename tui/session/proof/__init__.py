"""Test of a drive's reaction to communication loss."""
