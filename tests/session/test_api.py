"""The Python API on simulated drives; docs/api.md as printed."""

from __future__ import annotations

import inspect
import math
import re
import threading
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import pytest

import tui.session.api as api
from tui.bus.line_events import DevicesStopped
from tui.bus.program import Program
from tui.session.api import (
    AsyncDrive,
    AsyncDriveLine,
    AsyncRunningMotor,
    Drive,
    DriveError,
    DriveLine,
    LineError,
    NotStopped,
    NotWritten,
    RunningMotor,
    WouldRound,
    open_drives,
)
from tui.session.arming import NotArmed
from tui.session.connect.contradiction import Contradiction
from tui.session.connect.open_line import demo_line
from tui.session.journal import Journal

pytestmark = pytest.mark.long

PAGE = Path(__file__).resolve().parents[2] / "docs" / "api.md"
EXAMPLES = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)


@pytest.fixture
def line() -> Iterator[DriveLine]:
    with open_drives("sim:atv71@1,atv312@2,powerdrive@3") as opened:
        yield opened


@pytest.fixture
def drive(line: DriveLine) -> Drive:
    return line.drive()


@pytest.mark.parametrize("address", [0, 248, -1, "x", "1", 1.5, None])
def test_wrong_address_is_reported(line: DriveLine, address: object) -> None:
    with pytest.raises(DriveError, match="cannot be the address of a drive: use 1 to 247"):
        line.drive(address)  # type: ignore[arg-type]
    assert line.drive(1).profile == "atv71", "the line is not lost by it"


@pytest.mark.parametrize("example", EXAMPLES)
def test_examples_of_the_page_print_what_it_shows(
    example: str, capsys: pytest.CaptureFixture[str]
) -> None:
    exec(compile(example, "api.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed
    assert "not read now" not in printed
    if "NotWritten" in example:
        assert "HSP: " in printed
        assert "would be rounded to 0.0 Hz" in printed


def test_page_names_every_part_of_the_api() -> None:
    text = PAGE.read_text("utf-8")
    for name in api.__all__:
        assert f"`{name}`" in text, name
    for owner in (Drive, DriveLine, RunningMotor):
        for part in dir(owner):
            if not part.startswith("_"):
                assert f"`{owner.__name__}.{part}`" in text, part


@pytest.mark.parametrize(
    ("blocking", "awaited"),
    [(Drive, AsyncDrive), (DriveLine, AsyncDriveLine), (RunningMotor, AsyncRunningMotor)],
)
def test_async_calls_match_the_blocking_ones(blocking: type, awaited: type) -> None:
    names = [name for name in {*dir(blocking), *dir(awaited)} if not name.startswith("_")]
    for name in names:
        calls = getattr(blocking, name), getattr(awaited, name)
        if callable(calls[0]):
            arguments = [inspect.signature(call).parameters for call in calls]
            assert list(arguments[0].values()) == list(arguments[1].values()), name


def test_values_are_keyed_by_the_requested_names(drive: Drive) -> None:
    found = drive.read("hsp", "W3201", "NMA1")
    assert list(found) == ["hsp", "W3201", "NMA1"]
    assert (found["hsp"].code, found["hsp"].number, found["hsp"].unit) == ("HSP", Decimal(50), "Hz")
    assert (found["W3201"].code, found["W3201"].number) == ("ETA", None)
    assert all(value.good and not value.error for value in found.values())


def test_unknown_code_raises_drive_error(drive: Drive) -> None:
    with pytest.raises(DriveError, match="NONE"):
        drive.read("NONE")


@pytest.mark.parametrize("every", [math.nan, math.inf, 0.0, -1.0, 1e9])
def test_watch_refuses_an_impossible_cycle_time(drive: Drive, every: float) -> None:
    with pytest.raises(DriveError, match="not a cycle time"):
        next(drive.watch("ETA", every=every))


def test_unused_address_raises_line_error(line: DriveLine) -> None:
    with pytest.raises(LineError, match="9 did not answer"):
        line.drive(9)


def test_drive_has_its_reported_identity(line: DriveLine) -> None:
    other = line.drive(2)
    assert (other.address, other.profile) == (2, "atv312")
    assert other.reference.startswith("ATV312")
    with pytest.raises(Contradiction):
        line.drive(2, profile="atv71")


def test_drive_without_identification_needs_a_profile(line: DriveLine) -> None:
    assert line.drive(3).profile == "powerdrive", "a simulated line names it"
    line._calls._opened.profiles = {}
    with pytest.raises(DriveError, match=r"Name its profile: .*powerdrive"):
        line.drive(3)
    assert line.drive(3, profile="powerdrive").profile == "powerdrive"


def test_nothing_is_written_without_arming(drive: Drive) -> None:
    with pytest.raises(NotArmed, match=r"with drive\.armed"):
        drive.write({"HSP": 40})
    with drive.armed():
        pass
    with pytest.raises(NotArmed):
        drive.save()
    assert drive.read("HSP")["HSP"].number == Decimal(50)


def test_confirmed_write_is_read_back_and_recorded(drive: Drive) -> None:
    with drive.armed():
        reported = drive.write({"HSP": 40.5, "ACC": "3500ms"})
    assert reported["HSP"] == "HSP: 50.0 Hz -> 40.5 Hz"
    found = drive.read("HSP", "ACC")
    assert (found["HSP"].number, found["ACC"].number) == (Decimal("40.5"), Decimal("3.5"))


def test_writes_of_a_script_are_in_the_journal() -> None:
    with open_drives("sim:atv71") as line:
        drive = line.drive()
        with drive.armed():
            drive.write({"HSP": 40})
    entries = (Journal().path).read_text("utf-8").splitlines()
    assert ['"HSP"' in entry and '"script"' in entry for entry in entries] == [True]


def test_refused_value_is_reported_with_its_code(drive: Drive) -> None:
    with drive.armed(), pytest.raises(NotWritten) as refused:
        drive.write({"HSP": 700, "ACC": 4})
    assert list(refused.value.why) == ["HSP"]
    found = drive.read("HSP", "ACC")
    assert (found["HSP"].number, found["ACC"].number) == (Decimal(50), Decimal(4))


def test_value_that_would_be_rounded_is_refused(line: DriveLine) -> None:
    drive = line.drive(2)
    with drive.armed():
        with pytest.raises(WouldRound, match=r"LSP: 0\.04 would be rounded to 0\.0 Hz"):
            drive.write({"LSP": 0.04})
        assert drive.write({"LSP": 0.06}, rounded=True) == {"LSP": "LSP: 0.0 Hz -> 0.1 Hz"}


def test_duplicate_parameter_is_refused(drive: Drive) -> None:
    with drive.armed(), pytest.raises(DriveError, match="more than once"):
        drive.write({"ACC": 3, "W9001": 4})


def test_read_only_line_arms_no_drive() -> None:
    with open_drives("sim:atv71", read_only=True) as line:
        drive = line.drive()
        with pytest.raises(DriveError, match="read-only"), drive.armed():
            pass


def test_samples_follow_one_another(drive: Drive) -> None:
    samples = []
    # on a busy machine a value is truly old by the end of a much shorter cycle
    for sample in drive.watch("RFR", "ETA", every=0.5):
        samples.append(sample)
        if len(samples) == 4:
            break
    assert all(item.values["RFR"].good and not item.error for item in samples)
    assert {item.state for item in samples} == {"not ready"}
    times = [item.values["ETA"].time for item in samples]
    assert times == sorted(set(times))


def test_watch_ends_with_the_line() -> None:
    line = open_drives("sim:atv71")
    samples = line.drive().watch("ETA", every=0.05)
    next(samples)
    threading.Timer(0.1, line.close).start()
    with pytest.raises(LineError, match="closed"):
        for _ in samples:
            pass


def test_call_on_a_closed_line_raises() -> None:
    with open_drives("sim:atv71") as line:
        drive = line.drive()
    with pytest.raises(LineError, match="closed"):
        drive.read("ETA")


def test_stop_lasts_and_ends_arming() -> None:
    with DriveLine(demo_line({"atv71": 20.0})) as line:
        drive = line.drive()
        assert drive.read("RFR")["RFR"].number
        with drive.armed():
            assert "stopped" in drive.stop()
            with pytest.raises(NotArmed, match="Stopped"):
                drive.write({"ACC": 4})
        assert drive.read("RFR")["RFR"].number == 0


def test_stop_by_another_program_blocks_later_writes_in_the_block_only(
    line: DriveLine, drive: Drive
) -> None:
    """A script that continues may arm again; one stop is reported more than once."""
    facts = line._calls.line.facts
    other = Program("another's id", "stop", 4711)
    facts.events.emit(DevicesStopped((1,), "drivepanel stop", other))
    with drive.armed():
        assert "5" in drive.write({"ACC": 5})["ACC"]
        for _ in range(2):
            facts.events.emit(DevicesStopped((1,), "drivepanel stop", other))
        with pytest.raises(NotArmed, match="Stopped: no longer armed"):
            drive.write({"ACC": 6})
        with pytest.raises(NotArmed, match="Stopped: no longer armed"):
            drive.save()
    with drive.armed():
        assert "6" in drive.write({"ACC": 6})["ACC"]


def test_motor_that_cannot_be_stopped_raises() -> None:
    with open_drives("sim:atv71", read_only=True) as line, pytest.raises(NotStopped):
        line.drive().stop()
