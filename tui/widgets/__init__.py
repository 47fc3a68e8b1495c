"""Parts of screens: lines that redraw only what changed, and what is drawn in them."""
