"""Frames for other programs: pcapng with Modbus/TCP packets or raw serial frames."""
