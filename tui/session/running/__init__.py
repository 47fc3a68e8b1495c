"""Motor that runs during a command or a block: started, monitored, stopped."""
