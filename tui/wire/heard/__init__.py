"""What others say on a serial line: bytes apart into frames, frames into exchanges."""
