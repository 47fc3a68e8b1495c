"""Description of a drive family in a file: schema, loading, decoding, checks."""
