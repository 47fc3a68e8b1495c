"""Modbus TCP: one request with its reply."""
