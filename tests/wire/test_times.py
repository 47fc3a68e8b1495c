"""Bits and silences of a serial line."""

from __future__ import annotations

import pytest

from tui.simulator.spec import LineTiming
from tui.wire.frames import bits_per_character, character_seconds, is_format, silent_seconds


@pytest.mark.parametrize(
    ("format_", "bits"), [("8N1", 10), ("8E1", 11), ("8O1", 11), ("8N2", 11), ("8E2", 12)]
)
def test_bits_per_character(format_: str, bits: int) -> None:
    assert bits_per_character(format_) == bits


def test_unknown_format_raises() -> None:
    with pytest.raises(ValueError, match="7E1"):
        bits_per_character("7E1")


@pytest.mark.parametrize("format_", ["8N1", "8E1", "8O1", "8N2"])
@pytest.mark.parametrize("baud", [1200, 9600, 19200, 19201, 38400, 115200])
def test_line_and_simulator_agree_on_the_times(baud: int, format_: str) -> None:
    witness = LineTiming(baud=baud, format=format_)
    assert character_seconds(baud, format_) == pytest.approx(witness.character)
    assert silent_seconds(baud, format_) == pytest.approx(witness.silence)


def test_invalid_modbus_formats_are_refused() -> None:
    assert is_format("8E2")
    assert not any(is_format(text) for text in ("7E1", "8E3", "8X1", "8E1 ", ""))
