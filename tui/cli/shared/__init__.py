"""Parts shared by several commands: options, output, errors, logs, signals."""
