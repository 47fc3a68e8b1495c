"""Modbus RTU: frames found in the bytes of a line, and one request with its reply."""
