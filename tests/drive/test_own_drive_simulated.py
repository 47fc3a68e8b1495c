"""The example drive of profiles/README.md is checked, simulated and read like any other."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.session.test_command import bench
from tui.cli.main import main
from tui.drive.profile import library
from tui.session.connect.open_line import open_line
from tui.session.drive import DriveSession
from tui.session.drive_state import drive_state
from tui.session.read.reader import Reader
from tui.session.work import OutcomeKind
from tui.simulator import DriveSpec, SimulatedDrive, Simulation
from tui.simulator.proving.proof_steps import prove_profile

README = Path(__file__).parents[2] / "profiles" / "README.md"
ADDRESS = 5
PUMP = "example-pump"


@pytest.fixture
def own_file() -> Path:
    """The one profile in the README, in the configuration folder."""
    [text] = re.findall(
        r"^```toml\n(\[profile\]\n.*?)^```$", README.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    folder = library.user_folder()
    folder.mkdir(parents=True)
    path = folder / "pump.toml"
    path.write_text(text, encoding="utf-8")
    library.load.cache_clear()
    return path


def test_own_profile_is_checked_and_listed(own_file: Path) -> None:
    checked = CliRunner().invoke(main, ["profiles", "--check", str(own_file)])
    assert checked.exit_code == 0, checked.output
    assert "no fault found" in checked.output
    listed = CliRunner().invoke(main, ["profiles"])
    [line] = [text for text in listed.output.splitlines() if "(your own)" in text]
    assert line.startswith(PUMP)
    assert library.hints_of(own_file) == []


@pytest.mark.usefixtures("own_file")
def test_own_profile_is_proved_with_its_frame_and_its_commands() -> None:
    steps = {step.title: step.fault for step in prove_profile(library.load(PUMP))}
    assert [title for title, fault in steps.items() if fault] == []
    assert {
        "frame 01 03 00 64 00 02 means FREQ = 20.0 Hz",
        "reverse (Run reverse) leads to its state",
        "stop stops from reverse",
        "REF and FREQ agree",
    } <= set(steps)


@pytest.mark.usefixtures("own_file")
async def test_own_profile_runs_and_stops_its_simulated_motor() -> None:
    async with bench(PUMP) as made:
        made.commander.run("reverse", "20Hz")
        assert await made.done() == "Run reverse: Running"
        assert made.writes() == [(301, 200), (300, 3)]
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        assert made.writes()[-1] == (300, 0)


@pytest.fixture
def file_with_local_bit(own_file: Path) -> None:
    local = 'command = "CTRL"\nlocal = { parameter = "STAT", bit = 9 }\n'
    text = own_file.read_text("utf-8").replace('command = "CTRL"\n', local)
    own_file.write_text(text, "utf-8")


@pytest.mark.usefixtures("file_with_local_bit")
async def test_drive_in_local_control_is_stopped_but_not_started() -> None:
    async with bench(PUMP) as made:
        made.drive.keypad["LOC"]()
        made.commander.run("forward", "20Hz")
        refused = "The drive is in local control (STAT bit 9): it is not commanded by Modbus."
        assert refused in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == []
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        assert made.writes() == [(300, 0)]
        made.drive.keypad["REM"]()
        await made.arm()
        made.commander.run("forward", "20Hz")
        assert await made.done() == "Run forward: Running"


def test_simulated_drive_keeps_its_functions_and_limits(own_file: Path) -> None:
    drive = SimulatedDrive(library.load(PUMP), DriveSpec(PUMP, ADDRESS, sets={"FREQ": 482}))

    def ask(function: int, first: int, second: int) -> bytes | None:
        return drive.line_side.answer(ADDRESS, struct.pack(">BHH", function, first, second))

    assert ask(3, 101, 1) == struct.pack(">BBH", 3, 2, 482)
    assert ask(6, 200, 450) == struct.pack(">BHH", 6, 200, 450)
    assert ask(3, 200, 1) == struct.pack(">BBH", 3, 2, 450)
    assert ask(6, 200, 6001) == bytes([0x86, 3]), "above the maximum of RAMP"
    assert ask(3, 100, 17) == bytes([0x83, 3]), "past 16 words"
    assert ask(3, 150, 1) == bytes([0x83, 2]), "no such parameter"
    assert ask(16, 200, 1) == bytes([0x90, 1]), "no such function"


MORE = """
[[functions]]
code = 4
name = "Read input registers"
max_read = 8

[[parameters]]
code = "WATER"
name = "Water level"
number = "30102"
address = 101
function = 4
access = "r"
group = "Monitoring"
source = "guide 4.1"
confidence = "manual"
"""
FIELD = """
[[parameters]]
code = "VALVE"
name = "Valve"
number = "40202.4"
address = 201
mask = 0x3
shift = 4
access = "rw"
group = "Settings"
source = "guide 5.3"
confidence = "manual"
"""


def test_simulated_drive_has_input_registers_and_fields(own_file: Path) -> None:
    text = own_file.read_text("utf-8") + MORE + FIELD
    own_file.write_text(text.replace('code = "MODE"', 'code = "MODE"\nmask = 0xF'), "utf-8")
    assert library.faults_of(own_file) == []
    sets = {"FREQ": 482, "WATER": 77, "MODE": 2, "VALVE": 3}
    drive = SimulatedDrive(library.load(PUMP), DriveSpec(PUMP, ADDRESS, sets=sets))

    def ask(function: int, address: int) -> bytes | None:
        return drive.line_side.answer(ADDRESS, struct.pack(">BHH", function, address, 1))

    assert ask(3, 101) == struct.pack(">BBH", 3, 2, 482)
    assert ask(4, 101) == struct.pack(">BBH", 4, 2, 77)
    assert ask(4, 100) == bytes([0x84, 2]), "no such input register"
    assert ask(3, 201) == struct.pack(">BBH", 3, 2, 0x32)


@pytest.mark.parametrize(
    ("status", "trip", "state", "alarms"),
    [
        (0x1, 0, "ready", 0),
        (0x3, 0, "running", 0),
        (0xB, 0, "running", 1),
        (0x4, 7, "fault", 0),
        (0x1, 7, "fault", 0),
    ],
)
async def test_own_drive_is_read_over_a_line_with_its_state(
    own_file: Path, status: int, trip: int, state: str, alarms: int
) -> None:
    profile = library.load(PUMP)
    drive = DriveSpec(PUMP, ADDRESS, sets={"STAT": status, "FREQ": -125, "TRIP": trip})
    with Simulation([drive]) as simulation:
        host, port = simulation.serve_tcp()
        opened = open_line(f"tcp:{host}:{port}", wait=5)
        try:
            session = DriveSession(opened.line, ADDRESS, profile)
            readings = await Reader(session).read(["FREQ", "RAMP", "MODE", "STAT", "TRIP"])
        finally:
            opened.close()
    texts = {code: reading.value.text for code, reading in readings.items() if reading.value}
    assert [texts[code] for code in ("FREQ", "RAMP", "MODE")] == ["-12.5", "3.00", "By hand"]
    seen = drive_state(profile, readings)
    assert (seen.id, len(seen.alarms)) == (state, alarms)
    assert (seen.fault.code if seen.fault else "") == ("COM" if state == "fault" else "")
