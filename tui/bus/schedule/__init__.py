"""Who may ask when: the queue, the dispatcher, patience with slow devices, the line's own loop."""
