"""Frames as other programs read them: pcapng, as Modbus/TCP or as bytes of a serial line."""
