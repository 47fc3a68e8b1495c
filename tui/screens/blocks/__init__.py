"""Scanner and blocks: the screen, its keys, what it draws."""
