"""A motor that runs as long as a command or a block does: started, followed, brought to rest."""
