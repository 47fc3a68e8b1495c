"""One connected drive: identification, monitoring and reading; no screen, no Modbus library."""
