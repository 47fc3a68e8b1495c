"""Questions that a screen asks: each a dialog of its own, over the screen that asks it."""
