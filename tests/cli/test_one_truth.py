"""`status` and `run` agree on the command source of a drive, and name the way to command it."""

from __future__ import annotations

import json

import pytest

from tests.programs import drivepanel

from .commands import run, tcp_line

ELSEWHERE = {
    "Leroy-Somer at its terminals": (
        "powerdrive", {"6.43": 0},
        "6.43 is Terminals. In the panel, press t on Monitor to take control.",
    ),
    "Altivar 312 at its terminals": (
        "atv312", {"LAC": 2, "Fr1": 1}, "the active Reference channel 1 (Fr1) is Terminals.",
    ),
    "Altivar 31, second channel": (
        "atv31", {"LAC": 2, "Fr1": 164, "Fr2": 1, "rFC": 97},
        "the active Reference channel 2 (Fr2) is Terminals.",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("family", "sets", "why"), ELSEWHERE.values(), ids=ELSEWHERE.keys())
@pytest.mark.sweep
def test_status_and_run_use_the_same_words(family: str, sets: dict[str, int], why: str) -> None:
    words = [part for code, raw in sets.items() for part in ("--set", f"{code}={raw}")]
    with tcp_line(f"{family}@1", *words) as line:
        reported = json.loads(run(0, "status", line, "-p", family, "--json"))
        assert reported["commandable"] is False
        assert why in reported["why_not"]
        done = drivepanel("run", line, "-p", family, "--arm")
        assert (done.returncode, done.stdout) == (5, "")
        assert reported["why_not"] in done.stderr
        assert reported["why_not"] in run(0, "status", line, "-p", family)


@pytest.mark.parametrize(
    ("family", "sets"),
    [
        ("powerdrive", {"6.43": 1}),
        ("atv312", {"LAC": 2, "Fr1": 164}),
        ("atv31", {"LAC": 2, "Fr1": 1, "Fr2": 164, "rFC": 97}),
        ("atv31", {"LAC": 2, "CHCF": 2, "Fr1": 1, "Cd1": 1, "Cd2": 10, "CCS": 99}),
    ],
)
def test_idle_drive_set_up_for_modbus_is_commanded_by_modbus(
    family: str, sets: dict[str, int]
) -> None:
    words = [part for code, raw in sets.items() for part in ("--set", f"{code}={raw}")]
    with tcp_line(f"{family}@1", *words) as line:
        reported = json.loads(run(0, "status", line, "-p", family, "--json"))
    assert (reported["commandable"], reported["why_not"]) == (True, None)
    if family != "powerdrive":
        assert reported["commanded_by"] == "Modbus"
