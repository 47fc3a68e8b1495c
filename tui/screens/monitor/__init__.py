"""Monitor screen: the motor's state, its curves, and the run line."""
