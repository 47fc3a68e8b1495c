"""Bytes as a receiver at another baud or parity decodes them.

A port samples each bit in its middle, counted from the falling edge of a start bit. It searches
for the next start bit as soon as the stop bit is over, at any level on the wire.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Misheard:
    """The bytes that a port delivers, and its error counts."""

    data: bytes
    framing: int
    parity: int
    breaks: int


def levels(data: bytes, format_: str) -> list[int]:
    """Return the bits on the wire, without a pause between characters."""
    bits: list[int] = []
    for byte in data:
        character = [byte >> n & 1 for n in range(8)]
        bits += [0, *character]
        if format_[1] != "N":
            bits.append((sum(character) + (format_[1] == "O")) % 2)
        bits += [1] * int(format_[2])
    return bits


def misheard(data: bytes, sent: tuple[int, str], heard: tuple[int, str]) -> Misheard:
    """Return what a port set to `heard` receives of bytes `sent` so; each is baud and format."""
    wire, (rate, format_) = levels(data, sent[1]), heard
    end = len(wire) / sent[0]

    def level(time: float) -> int:
        at = int(time * sent[0])
        return wire[at] if at < len(wire) else 1

    found = bytearray()
    framing = parity = breaks = 0
    time, step, before = 0.0, 1 / (rate * 16), 1
    while time < end:
        now = level(time)
        if not (before and not now):
            before, time = now, time + step
            continue
        middle = time + 0.5 / rate
        if level(middle):
            before, time = 1, middle  # no start bit
            continue
        sampled = [level(middle + n / rate) for n in range(1, 11)]
        byte = sum(bit << n for n, bit in enumerate(sampled[:8]))
        last = 9
        if format_[1] != "N":
            last = 10
            parity += (sum(sampled[:9]) + (format_[1] == "O")) % 2
        if not sampled[last - 1]:
            framing += 1
            breaks += not any(sampled[:last])
        found.append(byte)
        time = middle + last / rate
        before = 1  # a port looks for a level, not for an edge
    return Misheard(bytes(found), framing, parity, breaks)
