"""Writes of one word, as they were sent."""

from __future__ import annotations

from tui.bus.api import ModbusLine


def words_written(line: ModbusLine) -> list[tuple[int, int]]:
    """Register and word of each write of one word in the line's trace."""
    sent = [frame.data for frame in line.trace if frame.direction == "out" and frame.data[1] == 6]
    return [(int.from_bytes(data[2:4], "big"), int.from_bytes(data[4:6], "big")) for data in sent]
