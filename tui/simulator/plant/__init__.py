"""Plant of a simulated drive: motor, load, faults, memory, watch of the line."""
