"""Modbus TCP for third-party programs: frames in, answers out; their content is unknown here."""
