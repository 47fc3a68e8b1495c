"""Plant of a simulated drive: motor, load, faults, memory, line timeout."""
