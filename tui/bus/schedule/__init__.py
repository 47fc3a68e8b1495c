"""Order of requests: the queue, the dispatcher, patience with slow devices, the line's own loop."""
