"""The command line: puts commands together; imports only what a command needs."""
