"""The terminal: reading its keys, drawing in few bytes, and the parts of Textual used for that."""
