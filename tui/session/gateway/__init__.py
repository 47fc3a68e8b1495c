"""A line for Modbus TCP clients: which drive is meant, what may be written, what is answered."""
