"""A drive as a file describes it: its schema, loading, decoding, checking."""
