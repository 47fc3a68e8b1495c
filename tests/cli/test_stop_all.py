"""`drivepanel stop --all` while other programs use the line."""

from __future__ import annotations

import asyncio
import importlib
import math
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.sweeps import kept
from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault, LineError
from tui.bus.fake import FakeLine
from tui.cli.running.stop_targets import StopWish, found_at
from tui.cli.running.stop_telling import StopTelling
from tui.cli.shared.errors import Failure
from tui.drive.profile import library
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.journal import Journal
from tui.session.starts.starts import Starts

from .commands import ended, run, tcp_line
from .printed import documents

stop_command = importlib.import_module("tui.cli.commands.stop")
NAMELESS = DriveIdentity(1, "", "", "", "", None, ("powerdrive", "proxidrive", "varmeca"))


def test_drive_whose_polling_is_paused_is_stopped_too() -> None:
    """As in a proof of its communication loss, perhaps with its motor turning."""
    with tcp_line("atv71@1", "atv312@2") as line:
        opened = open_line(line, wait=5, program="prove")
        try:
            opened.line.facts.pause_polling(2, "Its communication timeout is being proved.")
            reported = run(0, "stop", line, "--all", "--addresses", "1-2")
        finally:
            opened.close()
        assert "Device 1, Altivar 71: stopped" in reported
        assert "Device 2, Altivar 312: stopped" in reported
        assert opened.line.facts.stops.totals == {1: 1, 2: 1}


@pytest.mark.parametrize("heard", [None, -1.0, 1.0])
async def test_stop_that_is_not_answered_is_reported_early(
    heard: float | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(stop_command, "SILENT_FOR", 0.01)
    at = None if heard is None else time.monotonic() + heard
    line = SimpleNamespace(device_state=lambda _: SimpleNamespace(heard=at))
    async with stop_command.silence_reported(cast(Any, line), 7):
        await asyncio.sleep(0.05)
    answered = heard is not None and heard > 0
    assert ("NOT STOPPED yet: device 7" in capsys.readouterr().err) is not answered


async def stop_of(line: FakeLine, patience: Priority) -> str:
    """Profile by which an address is stopped."""
    journal, telling = Journal(), StopTelling("fake", as_json=False)
    wish = StopWish(OpenLine("fake", line), None, "stop", journal, telling)
    found = await found_at(wish, 1, None, patience)
    journal.close()
    return "" if found is None else found.name


def with_drive(damaged: float) -> FakeLine:
    """A line with an Altivar 71 whose first replies are damaged."""
    line = FakeLine({1: {3201: 0x0250}})
    line.devices[1].identity = {0: b"Telemecanique", 1: b"ATV71HU15M3", 2: b"V1.0"}
    line.fail_identify(1, ChecksumFault(1, 43, 0, received=b""), times=damaged)
    return line


async def test_damaged_replies_are_requested_again_with_a_longer_wait() -> None:
    for patience in (Priority.BACKGROUND, Priority.PATIENT):
        assert await stop_of(with_drive(2), patience) == "Altivar 71"
    with pytest.raises(LineError):  # the next round is the patient one
        await stop_of(with_drive(math.inf), Priority.BACKGROUND)
    with pytest.raises(Failure, match="NOT STOPPED"):
        await stop_of(with_drive(math.inf), Priority.PATIENT)
    silent = FakeLine({1: {}})
    silent.silence(1)
    assert await stop_of(silent, Priority.PATIENT) == ""


GUESSED = "NOT STOPPED: it is not known if the motor stopped"
WAYS = [("-d", "1"), ("--all", "--addresses", "1"), ("-d", "1", "-d", "2")]


@pytest.mark.parametrize("way", kept(WAYS, WAYS[0], WAYS[2]))
def test_stop_of_a_guessed_family_reports_not_stopped(way: tuple[str, ...]) -> None:
    with tcp_line("powerdrive@1", "atv71@2") as line:
        done = ended(4, "stop", line, *way)
        assert "Device 1: " + GUESSED in done.stderr
        assert "Read as Powerdrive, it is at standstill" in done.stderr
        assert "Device 1, " not in done.stdout
        assert ("Device 2, Altivar 71: stopped." in done.stdout) is ("2" in way)
        found = documents(ended(4, "stop", line, *way, "--json").stdout)
        row = next(document for document in found if document["device"] == 1)
        assert (row["profile"], row["stopped"], row["status"]) == (None, False, 4)
        named = ended(0, "stop", line, *way, "-p", "powerdrive")
        assert "Device 1, Powerdrive: stopped." in named.stdout


@pytest.mark.parametrize("guessed", [False, True])
@pytest.mark.parametrize("way", WAYS[:2])
def test_recorded_start_sets_the_family_unless_it_was_a_guess(
    way: tuple[str, ...], guessed: bool
) -> None:
    with tcp_line("powerdrive@1") as line:
        starts = Starts()
        record = starts.record(line, NAMELESS, "powerdrive", "forward", program="panel")
        starts.begin(replace(record, guessed=guessed))
        done = ended(4 if guessed else 0, "stop", line, *way)
        assert (GUESSED in done.stderr) is guessed


@pytest.mark.parametrize("way", kept(WAYS, WAYS[2]))
def test_named_profile_overrides_a_profile_with_the_same_reference(
    way: tuple[str, ...],
) -> None:
    """One of the folder that knows the very model has no say."""
    text = (library.packaged_folder() / "atv71.toml").read_text("utf-8")
    text = text.replace('id = "atv71"', 'id = "hoist"', 1)
    text = text.replace('name = "Altivar 71"', 'name = "Hoist"', 1)
    text = text.replace('reference_prefixes = ["ATV71"', 'reference_prefixes = ["ATV71HU15"', 1)
    folder = library.user_folder()
    folder.mkdir(parents=True)
    (folder / "hoist.toml").write_text(text, "utf-8")
    with tcp_line("atv71@1", "atv71@2") as line:
        assert "Device 1, Hoist: stopped." in run(0, "stop", line, *way)
        named = ended(0, "stop", line, *way, "-p", "atv71")
        assert "Device 1, Altivar 71: stopped." in named.stdout
        assert "Device 1, Hoist" not in named.output
