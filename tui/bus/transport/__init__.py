"""Bytes to and from a serial port or a TCP connection, and what ports there are."""
