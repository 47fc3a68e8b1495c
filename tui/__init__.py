"""Drive Panel: a keyboard-driven terminal panel for variable-speed drives on a Modbus line."""

__version__ = "0.2.1"
