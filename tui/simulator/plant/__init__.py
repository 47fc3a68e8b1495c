"""What a simulated drive moves and keeps: motor, load, faults, memory, watch of the line."""
