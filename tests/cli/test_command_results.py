"""Results of commands without a line: their complete texts and documents."""

from __future__ import annotations

import asyncio
import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock, Mock

import msgspec
import pytest

from tests.session.test_acceptance_result import result
from tests.session.test_proof_result import AS_SET
from tests.ui import fakes
from tui.bus.model import DeviceCounters, LastMinute
from tui.cli.commands import accept, bundle, counters, prove, record
from tui.cli.documents.document import DriveFields
from tui.cli.shared.errors import Failure
from tui.drive.finding import LineSetting
from tui.drive.profile import library
from tui.session.recording.triggers import TriggeredRows, parse_trigger

from .commands import invoked

# Recording


@pytest.mark.parametrize(
    ("triggers", "read"),
    [
        ((), ["RFR"]),
        (("14:30",), ["RFR"]),
        (("lcr>9,8", "RFR<1"), ["RFR", "LCR"]),
        (("command",), ["RFR", "CMD"]),
        (("fault",), ["RFR", "CHCF", "LFT", "ETA"]),
    ],
)
def test_words_of_the_triggers_are_read_too(triggers: tuple[str, ...], read: list[str]) -> None:
    profile = library.load("atv71")
    session = Mock(profile=profile, device=2)
    parsed = [parse_trigger(text) for text in triggers]
    drive = record.RecordedDrive(session, ["RFR"], parsed, TriggeredRows(0, 0, always=False))
    assert drive.read == read
    assert drive.command == ("CMD" if triggers == ("command",) else "")


def test_triggers_fire_by_the_cycles_of_a_drive() -> None:
    profile = library.load("atv71")
    parsed = [parse_trigger(text) for text in ("fault", "command", "LCR>2,1")]
    drive = record.RecordedDrive(
        Mock(profile=profile, device=2), ["RFR"], parsed, TriggeredRows(0, 0, always=False)
    )
    cycles = [fakes.READY, fakes.RUNNING, {**fakes.RUNNING, "CMD": 0}, fakes.FAULT]
    cycles = [{"CMD": 15, **cycle} for cycle in cycles]
    assert [drive.fired(fakes.snapshot_of(profile, cycle)) for cycle in cycles] == [
        [],
        ["LCR 8.4 > 2"],
        ["Command word 16#0000 after 16#000F"],
        ["Fault: Overbraking", "Command word 16#000F after 16#0000"],
    ]


# Acceptance tests


def test_result_of_a_test_as_a_document() -> None:
    found = result("passed", "failed")
    assert msgspec.to_builtins(accept.accept_document("L", found, {1: "t.svg"}, "out")) == {
        "schema": 1,
        "command": "accept",
        "line": "L",
        "device": 4,
        "profile": "atv312",
        "name": "Pump \x1b 4",
        "passed": False,
        "why_not": "Failed: step 2.",
        "begun": "1970-01-01T00:16:40.000+00:00",
        "ended": "1970-01-01T00:16:50.000+00:00",
        "ended_by": None,
        "by": "A. <Person>",
        "panel": "0.2",
        "profile_version": "1.0",
        "identity": {"version": "2.1"},
        "file": "t.toml",
        "file_hash": "abc",
        "settings_hash": "aa",
        "settings_hash_after": "aa",
        "folder": "out",
        "steps": [
            {
                "number": 1,
                "kind": "direction",
                "name": "A | B",
                "outcome": "passed",
                "text": None,
                "seconds": 2.0,
                "checks": [
                    {"name": "Status word", "value": "forward", "limit": "forward",
                     "passed": True},
                ],
                "curve": "t.svg",
            },
            {
                "number": 2,
                "kind": "reset",
                "name": "reset",
                "outcome": "failed",
                "text": "x < y",
                "seconds": 0.0,
                "checks": [],
                "curve": None,
            },
        ],
    }  # fmt: skip
    ended = replace(found, ended_by="ended by SIGINT", settings_hash="", settings_after="")
    reported = accept.accept_document("L", ended, {}, None)
    assert (reported.ended_by, reported.folder) == ("ended by SIGINT", None)
    assert (reported.settings_hash, reported.settings_hash_after) == (None, None)
    assert accept.accept_document("L", result("passed", "passed"), {}, None).why_not is None


@pytest.mark.parametrize(
    ("passed", "ended_by", "number", "status"),
    [("passed", "", 0, 0), ("failed", "", 0, 1), ("failed", "a key", 0, 6),
     ("failed", "ended by SIGTERM", 15, 143), ("passed", "", 15, 0)],
)  # fmt: skip
def test_status_of_a_test(passed: str, ended_by: str, number: int, status: int) -> None:
    found = replace(result("passed", passed), ended_by=ended_by)
    session = accept.AcceptSession(Mock(), Mock(), Path("out"), "", False)
    assert session._status(found, Mock(number=number)) == status


@pytest.mark.parametrize(
    ("typed", "turned"),
    [("r", "right"), ("RIGHT", "right"), ("L", "left"), ("left", "left"), ("x", ""), ("", "")],
)
async def test_person_says_which_way_the_motor_turned(
    typed: str, turned: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    questions: list[str] = []

    async def answered(question: str) -> str:
        questions.append(question)
        return typed

    monkeypatch.setattr("tui.cli.shared.asking.typed_answer", answered)
    session = accept.AcceptSession(Mock(), Mock(), Path("out"), "", False)
    assert await session._ask_turned("Which way?") == turned
    assert questions == ["Which way? [r right / l left]"]


# Proofs of a communication loss


FIELDS: DriveFields = {"line": "L", "device": 1, "profile": "atv312", "timeout": None}


@pytest.mark.parametrize(
    ("changes", "reset", "texts"),
    [
        ({}, True, []),
        ({"changed": "ttO is 2 s."}, True, ["ttO is 2 s."]),
        ({}, False, ["It is in the fault SLF1, Modbus communication now; `drivepanel reset` with"
                     " --arm ends that."]),
        ({"fault": "a fault"}, False,
         ["It is in a fault now; `drivepanel reset` with --arm ends that."]),
        ({"fault": ""}, False, []),
    ],
)  # fmt: skip
def test_result_of_a_proof_is_printed(
    changes: dict[str, Any], reset: bool, texts: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    found = replace(AS_SET, **changes)
    prove._tell(FIELDS, found, reset, False)
    assert capsys.readouterr().out.splitlines() == [f"Device 1: {found.text}", *texts]
    prove._tell(FIELDS, found, reset, True)
    was_reset = reset and bool(found.fault)
    assert f'"reset": {str(was_reset).lower()}' in capsys.readouterr().out


@pytest.mark.parametrize("failed", [False, True])
@pytest.mark.parametrize("turning", [False, True])
async def test_motor_that_turned_is_stopped_after_its_proof(
    turning: bool, failed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Any] = []

    class Prover:
        report: Any = None

        def __init__(self, *given: Any) -> None:
            made.append(given)

        async def prove(self) -> Any:
            return AS_SET

    monkeypatch.setattr("tui.session.proof.prover.Prover", Prover)
    monkeypatch.setattr("tui.session.proof.result.proof_entry", lambda *given: given)
    fleet, console = Mock(), Mock()
    console.session.device = 4
    fleet.stopper.wait.return_value = SimpleNamespace(failed=failed)
    proving = prove._proved(fleet, console, turning, quiet=True)
    if turning and failed:
        with pytest.raises(Failure, match=r"Device 4: NOT STOPPED\.") as raised:
            await proving
        assert raised.value.status == 4
    else:
        assert await proving is AS_SET
        console.journal.add.assert_called_once_with((console.session, AS_SET))
    permit = console.session.work.permit()
    assert made == [(console.session, console.journal, permit, turning)]
    if turning:
        fleet.stop.assert_called_once_with([console.session], by="the end of the proof")
        fleet.stopper.wait.assert_called_once_with([console.session], 60.0)
    else:
        fleet.stop.assert_not_called()


# Counters


def test_counters_are_shown_in_rows() -> None:
    last = SimpleNamespace(frames=300, damaged=2, saturated=False)
    full = SimpleNamespace(frames=9, damaged=65535, saturated=True)
    since = DeviceCounters(
        20, 18, 1, 2, 3, 4, {2: 5, 11: 1}, 160, 170, 0.4, (0,) * 3 + (7,) + (0,) * 50,
        LastMinute(),
    )  # fmt: skip
    bars = len(DeviceCounters().turnarounds)
    found = SimpleNamespace(
        since=replace(since, turnarounds=since.turnarounds[:bars]), counted_by="panel (pid 3)",
        seconds=12.34, line_load=0.25, device_load=0.1,
        drive=[("this port", SimpleNamespace(last=last, frames=20, damaged=1)),
               ("the other", SimpleNamespace(last=full, frames=0, damaged=3))],
        trouble="Not read.", line_minute=LastMinute(good=90, lost=2, damaged=1, foreign=4,
                                                    strays=5),
        total=DeviceCounters(minute=LastMinute(good=8, lost=1, silent=2)),
    )  # fmt: skip
    rows = list(counters._rows(cast(Any, found)))
    turnaround = next(text for title, text in rows if title == "Turnaround")
    assert turnaround.endswith(": 7")
    assert rows == [
        ("Counted by", "panel (pid 3), which owns the line; for 12.3 s"),
        ("Sent", "20 frames, 160 bytes, 4 of them repeats"),
        ("Answered", "18, 170 bytes"),
        ("Not answered", "1 timeouts, 2 damaged, 3 unexpected"),
        ("Last minute", "line 90 of 93 replies good; this drive 8 of 11 replies good;"
                        " 4 foreign frames, 5 strays"),
        ("Refused", "exception 2: 5, exception 11: 1"),
        ("Load of the line", "25%, 10% with this drive"),
        ("Turnaround", turnaround),
        ("This port", "300 frames, 2 with a wrong checksum; 20 and 1 since the first look"),
        ("The other", "9 frames, 65535 or more with a wrong checksum; 0 and 3 since the first"
                      " look"),
        ("Drive", "Not read."),
    ]  # fmt: skip
    found.since, found.counted_by, found.line_load = DeviceCounters(), "", None
    found.drive, found.trouble = [], ""
    rows = list(counters._rows(cast(Any, found)))
    assert rows[0] == ("Counted by", "this program; for 12.3 s")
    assert rows[5:] == [("Refused", "0"), ("Turnaround", "-----")]


async def test_counters_are_read_again_after_a_lost_reply() -> None:
    for troubles, looks in (([""], 1), (["a", ""], 2), (["a"] * 9, 3)):
        counter = Mock()

        async def look(counter: Mock = counter, left: list[str] = troubles) -> None:
            counter.trouble = left.pop(0)

        counter.look = AsyncMock(side_effect=look)
        await counters._look(counter)
        assert counter.look.await_count == looks


# Bundles


def test_parts_of_a_bundle_are_counted_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False)
    assert bundle._progress() is None
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    show = bundle._progress()
    assert show is not None
    for done, name in ((0, "a.json"), (1, "longer.json"), (2, "")):
        show(done, 2, name)
    first, second = "Collecting 1 of 2: a.json", "Collecting 2 of 2: longer.json"
    assert capsys.readouterr().err == f"\r{first}\r{second}\r{'Collected 2 parts.':<30}\n"


def test_drives_of_a_bundle_are_the_named_or_known_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    known = "tui.session.bundle.line_parts.remembered_devices"
    monkeypatch.setattr(known, lambda link: [5, 3] if link == "link" else [])
    opened = Mock(devices=(7,))
    opened.line.pace.others = [4]
    link = cast(Any, "link")
    assert bundle._devices((9, 2, 9), opened, link) == (9, 2)
    assert bundle._devices((), opened, link) == (3, 4, 5, 7)
    assert bundle._devices((), None, link) == (3, 5)
    assert bundle._devices((), None, None) == (1,)


# Scans


E1, N2 = LineSetting(19200, "8E1"), LineSetting(9600, "8N2")
SCANS: dict[str, tuple[dict[str, Any], int, str]] = {
    "none at one setting": (
        {"settings": [E1], "tried": [E1], "done": True, "setting": E1}, 3,
        "No drives found at addresses 1-9. Tried 19200 8E1. Are the drives on, and are the two"
        " wires those of the line? --all-settings tries other baud rates and formats.\n",
    ),
    "none over a network": (
        {"done": True}, 3,
        "No drives found at addresses 1-9. Are the drives on, and are the two wires those of the"
        " line?\n",
    ),
    "none, with a remark": (
        {"done": True, "remarks": ["Damaged."]}, 3,
        "No drives found at addresses 1-9. Damaged. drivepanel why LINE -d ADDRESS names the cause"
        " and the next steps.\n",
    ),
    "one": (
        {"settings": [E1], "tried": [E1], "done": True, "hits": [1]}, 0,
        "1 drive found at addresses 1-9. Tried 19200 8E1.\n",
    ),
    "three, ended early": (
        {"settings": [E1, N2], "tried": [E1], "hits": [1, 2, 3], "held_back": "Slow."}, 0,
        "3 drives found at addresses 1-9, not all of which were asked. Tried 1 of 2 settings.\n",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCANS)
def test_end_of_a_scan(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    changes, status, text = SCANS[name]
    made: list[Any] = []

    class Scan(SimpleNamespace):
        def __init__(self, opened: Any, line_text: str, devices: Any, tell: Any, *, yes: bool):
            found = {"settings": [], "tried": [], "done": False, "hits": [], "remarks": [],
                     "held_back": "", "setting": None, "sessions": [], **changes}  # fmt: skip
            super().__init__(tell=tell, **found)
            made.append((line_text, list(devices), yes))

        async def run(self) -> None:
            pass

    async def prepared(_: Any, *, all_settings: bool) -> None:
        made.append(all_settings)

    module = importlib.import_module("tui.cli.commands.scan")
    monkeypatch.setattr(module, "_prepare", prepared)
    monkeypatch.setattr(module, "on_line", lambda _l, work, **_: asyncio.run(work(None)))
    monkeypatch.setattr("tui.cli.running.scanning.Scan", Scan)
    words = ("scan", "sim:atv71", "--addresses", "1-9")
    done = invoked(*words)
    assert done.stderr.startswith(f"drivepanel: {text}"[:-1])
    assert (done.exit_code, done.stdout) == (status, "")
    done = invoked(*words, "--json", "--yes", "--all-settings")
    assert made == [
        ("sim:atv71", list(range(1, 10)), False), False,
        ("sim:atv71", list(range(1, 10)), True), True,
    ]  # fmt: skip
    ended = msgspec.json.decode(done.stdout.splitlines()[0])
    settings = [{"baud": item.baud, "format": item.format} for item in changes.get("tried", [])]
    assert (ended["event"], ended["found"]) == ("ended", len(changes.get("hits", [])))
    assert (ended["settings"], ended["addresses"]) == (settings, "1-9")
    assert ended["not_tried"] == len(changes.get("settings", [])) - len(settings)
    assert ended["held_back"] == changes.get("held_back")
    assert (ended["done"], ended["remarks"]) == (
        changes.get("done", False), changes.get("remarks", []),
    )  # fmt: skip
