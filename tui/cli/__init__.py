"""The command line: composition root beside the panel; imports what a command needs, no more."""
