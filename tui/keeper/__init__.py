"""The process that holds a line for the programs on it: no terminal, no screen, no command line."""
