"""State charts of simulated drives, and the words that show their states."""
