"""What several commands use: options, output, errors, logs, signals."""
