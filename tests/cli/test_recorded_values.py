"""Values of drives as each output prints them: watched, as metrics, as messages, as a status.

`recorded_values.txt` has a section for each output. The cycles are invented, no line is opened.
"""

from __future__ import annotations

import io
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import replace
from decimal import Decimal
from itertools import product
from pathlib import Path

import msgspec
import pytest

from tests.drive.test_whole_values import HELD, OTHER, whole
from tests.recorded import sections
from tests.ui.fakes import readings_of
from tui.bus.api import Contact, DeviceCounters, LastMinute, LineCounters, LineState, LineStatus
from tui.bus.fake import FakeLine
from tui.cli.plant.metrics import metrics_text
from tui.cli.plant.status import DriveStatus, LineReport, drive_status_of
from tui.cli.plant.topics import drive_messages, line_messages
from tui.cli.shared.csv_files import CsvFile
from tui.cli.shared.output import print_readings
from tui.cli.shared.watch_outputs import (
    CsvOutput,
    JsonOutput,
    LabelsNeeded,
    LineOutput,
    Output,
    TableOutput,
    WatchedDrive,
    csv_columns,
    csv_units,
    text_output,
)
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.teaching import TaughtScale
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.drive_state import drive_state
from tui.session.monitor.snapshot import Snapshot
from tui.session.reading import Reading
from tui.session.shown import Quality
from tui.session.timeout_report import Timeout, TimeoutWatch

TEXTS = Path(__file__).parent / "recorded_values.txt"
NOW, WALL = 1000.0, 1_767_362_400.25
CONNECTED = LineState(LineStatus.CONNECTED, "", NOW)
LOST = LineState(LineStatus.LOST, "The port is gone.", NOW)
CODES = ("STAT", "FOUT", "TRIP", "TEMP", "HOUR", "RATE", "PIDF", "CHST")
LABELS = [LabelsNeeded(*both) for both in product((False, True), repeat=2)]
STOPS = whole().data.communication_fault
REACTION = next(each for each in STOPS.reactions if each.trips) if STOPS is not None else None


class Terminal(io.StringIO):
    """Standard output that is a terminal."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


@contextmanager
def terminal(**environment: str) -> Iterator[None]:
    """The environment of a terminal with 60 columns."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("NO_COLOR", "FORCE_COLOR", "COLORTERM", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
            patch.delenv(name, raising=False)
        for name, text in ({"TERM": "xterm", "COLUMNS": "60", "LINES": "20"} | environment).items():
            patch.setenv(name, text)
        yield


@contextmanager
def printed(out: io.StringIO | None = None, err: io.StringIO | None = None) -> Iterator[list[str]]:
    """Lines printed inside, those of standard error behind a mark."""
    lines: list[str] = []
    out, err = out or io.StringIO(), err or io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        yield lines
    lines += out.getvalue().splitlines()
    lines += [f"! {text}" for text in err.getvalue().splitlines()]


def drive(device: int = 7, profile: str = "", *, reported: str = "EXFAN-22") -> DriveSession:
    family = library.load(profile) if profile else whole()
    identity = DriveIdentity(device, "Example", reported, "", "", family.id, (family.id,))
    session = DriveSession(FakeLine({device: {}}), device, family, identity if reported else None)
    session.timeout = Timeout(True, TimeoutWatch(10.0, REACTION, True, "TOUT", "COM"))
    return session


def changed(reading: Reading, **parts: object) -> Reading:
    """A reading whose value has other parts."""
    assert reading.value is not None
    return replace(reading, value=replace(reading.value, **parts))  # type: ignore[arg-type]


def cycle(raws: dict[str, int], *codes: str, error: str = "", period: float = 1.0) -> Snapshot:
    """A cycle that ended half a second ago, its values a quarter of a second earlier."""
    known = {code: raw for code, raw in raws.items() if code in codes}
    readings = readings_of(whole(), known, NOW - 0.75)
    if "PIDF" in readings:
        readings["PIDF"] = changed(readings["PIDF"], unsure=True)
    if "RATE" in readings:
        readings["RATE"] = changed(readings["RATE"], taught=True)
    if "TEMP" in readings:
        readings["TEMP"] = changed(readings["TEMP"], unit="l/min")
    if "HOUR" in readings:
        readings["HOUR"] = replace(readings["HOUR"], quality=Quality.STALE, error="No reply.")
    if error:
        readings = {c: replace(each, quality=Quality.STALE) for c, each in readings.items()}
    for code in set(codes) - known.keys():
        missing = whole()[code]
        readings[code] = Reading(missing, None, None, Quality.BAD, NOW - 0.75, "Exception 2")
    readings = {code: readings[code] for code in codes}
    state = drive_state(whole(), readings)
    contact: Contact = "silent" if error else "answers"
    return Snapshot(
        3, NOW - 0.5, WALL, readings, state, 1.0, error, CONNECTED,
        period=period, wished=1.0, contact=contact,
    )  # fmt: skip


RUNS = {**HELD, "TRIP": 0}
CYCLES = {
    "good": cycle(RUNS, *CODES),
    "slow": cycle({**RUNS, "STAT": 0x0801}, *CODES, period=3.2104567),
    "failed": cycle(HELD, *CODES, error="Device 7 did not answer.", period=3.2104567),
    "failed again": cycle(HELD, *CODES, error="Device 7 did not answer.", period=3.2104567),
    "in fault": cycle({**OTHER, "TRIP": 1}, *CODES),
    "few": cycle({"FOUT": 3}, "FOUT", "TRIP"),
}
"""By name: cycles, one after the other."""


def pair() -> list[WatchedDrive]:
    """A drive on each of two lines; the second one has fewer codes, and a learned scale."""
    return [
        WatchedDrive(drive(), list(CODES), "serial:/dev/x", "pump"),
        WatchedDrive(drive(8), ["FOUT", "TRIP", "ACCE"], "tcp:10.0.0.9", "fan"),
    ]


def fed(output: Output, watched: list[WatchedDrive]) -> None:
    for name, snapshot in CYCLES.items():
        output.take(watched[name == "few"], snapshot)


def watched_as_lines() -> Iterator[str]:
    for labels in LABELS:
        with printed() as lines:
            fed(LineOutput(labels), pair())
        yield f"{labels}"
        yield from lines


def watched_as_objects() -> Iterator[str]:
    """Trouble is reported when it begins, and when it begins again."""
    for labels in (LABELS[1], LABELS[2]):
        with printed() as lines:
            output, watched = JsonOutput(labels), pair()
            fed(output, watched)
            output.take(watched[0], CYCLES["failed"])
        yield f"{labels}"
        yield from lines if labels.lines else (text for text in lines if text.startswith("!"))


def watched_as_tables() -> Iterator[str]:
    """Each table is on the terminal at once, and a file gets lines."""
    from rich.console import Console
    from rich.live import Live

    for width, labels in ((60, LABELS[0]), (100, LABELS[3])):
        watched, shown = pair(), io.StringIO()
        with terminal():
            console = Console(file=shown, width=width, height=40, force_terminal=True)
            with Live(console=console, auto_refresh=False) as live:
                output = TableOutput(live, watched, labels)
                for name in ("slow", "few") if labels.lines else ("good", "failed"):
                    at = len(shown.getvalue())
                    output.take(watched[name == "few"], CYCLES[name])
                    yield f"{width} {labels} {name}"
                    yield from map(repr, shown.getvalue()[at:].splitlines())
    for out in (Terminal(), io.StringIO()):
        watched, before = pair(), threading.active_count()
        with terminal(), printed(out), text_output(watched, LABELS[3]) as made:
            made.take(watched[1], CYCLES["few"])
            early = out.getvalue()
            assert threading.active_count() == before, "it is drawn by no thread of its own"
        yield f"{type(made).__name__}"
        yield from map(repr, early.splitlines())


def watched_as_csv() -> Iterator[str]:
    """Rows in a file; the unit of a column is that of the first drive that has the code."""
    with tempfile.TemporaryDirectory() as folder:
        for number, labels in enumerate((LABELS[0], LABELS[3])):
            watched = pair()
            units = csv_units(watched)
            scales = dict.fromkeys(("FOUT", "TRIP"), TaughtScale(Decimal("0.1"), "Hz", signed=True))
            watched[1].session.profile = Profile(whole().data, whole().read_help, taught=scales)
            path = Path(folder, f"{number}.csv")
            columns = csv_columns(watched, units, labels)
            file = CsvFile(path, [column.title for column in columns])
            output = CsvOutput(file, units, labels)
            fed(output, watched)
            assert path.read_text("utf-8").count("\n") == file.rows + 1, "each row is kept at once"
            file.close()
            yield f"{units} {file.rows}"
            yield from path.read_text("utf-8").splitlines()


def reports() -> list[LineReport]:
    """Lines with drives in every state."""
    named = [drive(), drive(), drive(reported=""), drive()]
    named[2].timeout = Timeout(known=False)
    named[3].timeout = None
    own = DeviceCounters(
        20, 15, 3, checksum=2, exceptions={11: 4, 2: 1}, turnarounds=tuple(range(10)),
        minute=LastMinute(good=7, lost=1, silent=4, damaged=1),
    )  # fmt: skip
    counters = LineCounters(
        requests=101, replies=90, timeouts=8, searched=5, checksum=7, wrong=6, exceptions=4,
        resyncs=3, stale=2, bytes_out=808, bytes_in=909, busy_seconds=12.5, repeats=9,
        devices={7: own}, minute=LastMinute(100, 20, 0, 3, 11, 12),
    )  # fmt: skip
    drives = (
        drive_status_of(7, named[0], CYCLES["good"], NOW),
        drive_status_of(1, named[1], CYCLES["in fault"], NOW),
        drive_status_of(2, named[2], CYCLES["failed"], NOW),
        drive_status_of(3, named[3], CYCLES["slow"], NOW + 99),
        drive_status_of(4, named[0], CYCLES["failed"], NOW + 99),
        drive_status_of(9, named[1], CYCLES["slow"], NOW + 0.5),
        drive_status_of(5, None, CYCLES["good"], NOW + 99),
        DriveStatus(6, named[0], None, "", "answers"),
        DriveStatus(8, error="Device 8 did not answer.", contact="silent"),
    )
    line = LineReport("pump/1", "serial:/dev/x", CONNECTED, counters, drives)
    return [line, LineReport('a"b\\c\nd', "tcp:h", LOST, LineCounters(requests=1), ())]


def metrics() -> Iterator[str]:
    """Samples of 0 are left out; there is at least one other of each metric."""
    lines = metrics_text(reports(), "1.2", NOW).splitlines()
    yield f"{len(lines)}"
    yield from (text for text in lines if not text.endswith(" 0"))
    yield from metrics_text([], "1.2", NOW).splitlines()


def messages() -> Iterator[str]:
    for made in (drive_messages, line_messages):
        yield from (f"{topic}: {text}" for topic, text in made("hall/2", reports()).items())


def readings() -> Iterator[str]:
    """A table of readings, on terminals and in a file."""
    shown = dict(CYCLES["good"].readings)
    rated = shown["FOUT"]
    assert isinstance(rated, Reading)
    assert rated.value is not None
    shown["FOUT"] = replace(rated, physical=replace(rated.value, text="8.1", unit="A"))
    markup = msgspec.structs.replace(rated.parameter, name="[red]A[/red] :smile: 12")
    shown["MARK"] = replace(rated, parameter=markup)
    shown |= {c: r for c, r in CYCLES["few"].readings.items() if c not in shown}
    found = {code: each for code, each in shown.items() if isinstance(each, Reading)}
    for out, environment in (
        (Terminal(), {}), (Terminal(), {"COLUMNS": "130"}), (Terminal(), {"NO_COLOR": "1"}),
        (Terminal(), {"COLUMNS": "40"}),
        (io.StringIO(), {}),
    ):  # fmt: skip
        with terminal(**environment), printed(out) as lines:
            print_readings(found)
        yield f"{environment}"
        yield from map(repr, lines)


SECTIONS = (
    watched_as_lines, watched_as_objects, watched_as_tables, watched_as_csv, metrics, messages,
    readings,
)  # fmt: skip


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_values_are_printed_as_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
