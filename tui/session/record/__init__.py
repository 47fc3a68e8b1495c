"""The flight recorder: what was on a line, in one SQLite file per line and day."""
