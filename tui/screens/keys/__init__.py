"""What each key does, on which screen: the table of actions, help, finding."""
