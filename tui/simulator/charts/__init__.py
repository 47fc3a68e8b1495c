"""The state charts that simulated drives play, and the words that they show."""
