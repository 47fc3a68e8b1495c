"""Traffic of other masters on a serial line: bytes into frames, frames into exchanges."""
