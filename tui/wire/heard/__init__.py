"""Traffic of others on a serial line: bytes into frames, frames into exchanges."""
