"""Bytes to and from a serial port or a TCP connection, and the list of ports."""
