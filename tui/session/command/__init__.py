"""Moving a motor: commands, references, stops, who commands."""
