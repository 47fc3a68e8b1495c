"""`drivepanel status` over several lines: each is named, none hides another."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from .commands import ended, refused, run, tcp_line
from .printed import form_of
from .test_watch_lines import NOBODY, settings

pytestmark = pytest.mark.long


@pytest.fixture
def named() -> Iterator[tuple[str, str]]:
    """The lines `pump`, with the drives 1 and 2, and `fan`, whose drive is 5; written out."""
    with ExitStack() as stack:
        pump = stack.enter_context(tcp_line("atv71@1", "atv312@2"))
        fan = stack.enter_context(tcp_line("atv312@1", "atv71@5"))
        settings(pump, fan)
        yield pump, fan


def listed(text: str) -> list[dict[str, Any]]:
    """The list of an output; its documents fit the schema."""
    found: list[dict[str, Any]] = json.loads(text)
    for row in found:
        form_of(row)
    return found


def test_drives_are_listed_with_their_lines_in_order(named: tuple[str, str]) -> None:
    pump, fan = named
    reported = listed(run(0, "status", "pump@2,1", "fan", "--json"))
    drives = [(pump, 2, "atv312"), (pump, 1, "atv71"), (fan, 5, "atv71")]
    assert [(row["line"], row["device"], row["profile"]) for row in reported] == drives
    text = run(0, "status", "pump@2,1", "fan").splitlines()
    assert [line for line in text if line.endswith(":")] == [
        "pump  device 2:", "pump  device 1:", "fan  device 5:",
    ]  # fmt: skip


def test_each_drive_of_all_lines_has_one_row(named: tuple[str, str]) -> None:
    # the profile of the settings file is that of drive 5, and of no other on its line
    rows = run(0, "status", "pump@1", "fan", "--all", "--addresses", "1-5").splitlines()
    assert [row.split()[:2] for row in rows] == [["pump", "1"], ["fan", "1"], ["fan", "5"]]
    assert [row.split()[2][:6] for row in rows] == ["ATV71H", "ATV312", "ATV71H"]
    assert run(0, "status", "fan@1", "--all").split()[:2] == ["1", "ATV312HU09M3"]


@pytest.mark.parametrize("every", [(), ("--all", "--addresses", "5")])
def test_missing_line_does_not_hide_others(named: tuple[str, str], every: tuple[str, ...]) -> None:
    done = ended(3, "status", NOBODY, "fan", *every, "--json")
    missing, found = listed(done.stdout)
    assert (missing["line"], missing["status"]) == (NOBODY, 3)
    assert missing.get("device") == (None if every else 1)
    assert (found["line"], found["device"]) == (named[1], 5)
    assert f"drivepanel: {NOBODY}: " in done.stderr


def test_absent_drive_does_not_hide_others(named: tuple[str, str]) -> None:
    done = ended(3, "status", "pump@9,1", "fan", "--json")
    assert [row.get("profile") for row in listed(done.stdout)] == [None, "atv71", "atv71"]
    assert "drivepanel: pump: Device 9 did not answer" in done.stderr
    assert "drivepanel: pump: No answer at 9." in ended(
        3, "status", "pump@9", "fan", "--all", "--addresses", "5"
    ).stderr  # fmt: skip


def test_drives_of_several_lines_stay_polled(named: tuple[str, str]) -> None:
    assert run(0, "status", "pump", "fan", "--hold", "0.2").count("State ") == 2


def test_invalid_line_opens_no_line_and_exits_with_2(named: tuple[str, str]) -> None:
    assert "'nonsense' is not a LINE" in refused(2, "status", "pump", "nonsense")
    assert "1 to 247" in refused(2, "status", "pump@300", "fan")
