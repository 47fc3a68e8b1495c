"""A motor that runs as long as a command does: its end, what is told of it, its way to rest."""
