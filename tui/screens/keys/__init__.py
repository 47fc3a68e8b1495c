"""Keys by screen: the table of actions, help, search."""
