"""Times of characters and silences on a serial line (Modbus over serial line 2.5.1.1)."""

from __future__ import annotations

import re

FAST = 19200
"""Baud above which the silence between frames is FAST_SILENCE."""
FAST_SILENCE = 0.00175
"""Seconds."""
SILENT_CHARACTERS = 3.5
_FORMAT = re.compile(r"8([NEO])([12])")


def is_format(text: str) -> bool:
    """Return True if a text is a character format that Modbus RTU can have: 8E1, 8N1, 8O1, 8N2
    ..."""
    return _FORMAT.fullmatch(text) is not None


def bits_per_character(format_: str) -> int:
    """Bits on the wire for one character: start, data, parity and stop bits. Raises ValueError."""
    match = _FORMAT.fullmatch(format_)
    if match is None:
        raise ValueError(f"{format_!r} is not a serial format")
    return 1 + 8 + (match[1] != "N") + int(match[2])


def character_seconds(baud: int, format_: str) -> float:
    """Seconds for one character. Raises ValueError."""
    return bits_per_character(format_) / baud


def silent_seconds(baud: int, format_: str) -> float:
    """Seconds of silence between two frames: 3.5 characters, 1.75 ms above 19 200 baud."""
    return FAST_SILENCE if baud > FAST else SILENT_CHARACTERS * character_seconds(baud, format_)
