"""Which motors were started, on record before the frame goes out."""
