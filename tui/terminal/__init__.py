"""The terminal as the panel meets it: what its keys send, and Textual's private parts for that."""
