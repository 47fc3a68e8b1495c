"""Messages: everything that was said, newest first."""
