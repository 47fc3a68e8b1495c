"""Describing simulated drives and lines."""

from __future__ import annotations

import pytest

from tui.simulator import (
    DriveSpec,
    FaultRates,
    LineTiming,
    Simulation,
    SimulatorError,
    parse_drives,
)

from .small import PROFILES


def test_drives_are_read_with_the_next_free_addresses() -> None:
    specs = parse_drives("atv71@2, ATV21 ,atv312,powerdrive@1")
    assert [(s.profile, s.address) for s in specs] == [
        ("atv71", 2),
        ("atv21", 3),
        ("atv312", 4),
        ("powerdrive", 1),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "names no profile"),
        ("atv71,,atv21", "names no profile"),
        ("atv71@0", "1 to 247"),
        ("atv71@248", "1 to 247"),
        ("atv71@", "1 to 247"),
        ("atv71@x", "1 to 247"),
        ("atv71@3,atv21@3", "each its own"),
    ],
)
def test_invalid_sets_are_reported(text: str, message: str) -> None:
    with pytest.raises(SimulatorError, match=message):
        parse_drives(text)


@pytest.mark.parametrize(
    ("baud", "form", "bits", "silence"),
    [
        (19200, "8E1", 11, 3.5 * 11 / 19200),
        (9600, "8N1", 10, 3.5 * 10 / 9600),
        (19200, "8N2", 11, 3.5 * 11 / 19200),
        (38400, "8O1", 11, 0.00175),
    ],
)
def test_line_timing_is_parsed(baud: int, form: str, bits: int, silence: float) -> None:
    timing = LineTiming(baud, form)
    assert timing.bits_per_character == bits
    assert timing.character == pytest.approx(bits / baud)
    assert timing.silence == pytest.approx(silence)


@pytest.mark.parametrize("form", ["", "8X1", "7E1", "8E3", "8e1"])
def test_invalid_format_is_refused(form: str) -> None:
    with pytest.raises(SimulatorError, match="character format"):
        LineTiming(19200, form)


def test_invalid_baud_is_refused() -> None:
    with pytest.raises(SimulatorError, match="baud"):
        LineTiming(0)


@pytest.mark.parametrize("rates", [{"lost": -0.1}, {"late": 1.1}, {"lost": 0.6, "late": 0.6}])
def test_rates_are_probabilities(rates: dict[str, float]) -> None:
    with pytest.raises(SimulatorError):
        FaultRates(**rates)  # type: ignore[arg-type]


def test_two_drives_cannot_share_an_address() -> None:
    with pytest.raises(SimulatorError, match="address 4"):
        Simulation([DriveSpec("atv71", 4), DriveSpec("atv21", 4)], profiles=PROFILES)
