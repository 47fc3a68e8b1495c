"""Lines of the bench: supply, wire, load, faults, planted defects, and times."""

from __future__ import annotations

import threading

import pytest

from tui.simulator import BENCH, Bench, BenchResult, DriveSpec, Simulation, SimulatorError
from tui.simulator.plant.conditions import PLANTS

from ..sources import ROOT
from .exchange import Exchange
from .small import PROFILES


def simulation(*profiles: str, **more: object) -> Simulation:
    drives = [
        DriveSpec(profile, address, **more)  # type: ignore[arg-type]
        for address, profile in enumerate(profiles, 2)
    ]
    return Simulation(drives, profiles=PROFILES)


def pass_time(made: Simulation, seconds: float) -> None:
    for drive in made.drives:
        for _ in range(round(seconds / 0.05)):
            drive.step(0.05)


def test_trip_trips_the_named_drive_alone() -> None:
    made = simulation("atv312", "atv71")
    (result,) = Bench(made).do("2: trip OCF")
    assert (result.device, result.text, result.state.fault) == (2, "tripped with OCF", "OCF")
    assert made.drive(3).fault is None


def test_trip_that_stays_needs_clear_before_a_reset() -> None:
    bench = Bench(made := simulation("atv312"))
    bench.do("trip OCF stays")
    assert (fault := made.drive(2).fault) is not None
    assert fault.persists
    (result,) = bench.do("clear")
    assert result.text == "cleared; reset fault OCF to go on"
    assert (fault := made.drive(2).fault) is not None
    assert not fault.persists


def test_all_reports_each_drive_and_changes_none_if_one_cannot() -> None:
    bench = Bench(made := simulation("atv312", "atv21"))
    assert [result.device for result in bench.do("all: power off")] == [2, 3]
    bench.do("all: power on")
    with pytest.raises(SimulatorError, match="has no fault 'OCF'"):
        bench.do("all: trip OCF")
    assert made.drive(2).fault is None


def test_power_off_silences_the_drive_and_on_again_it_answers() -> None:
    bench = Bench(made := simulation("atv71"))
    bench.do("power off")
    assert made.line.ask(2, bytes.fromhex("030C810001")) is None
    assert bench.do("power off")[0].text == "power off"
    bench.do("power on")
    assert made.line.ask(2, bytes.fromhex("030C810001")) is not None


def test_trip_without_supply_reports_why_not() -> None:
    bench = Bench(simulation("atv71"))
    bench.do("power off")
    (result,) = bench.do("trip OCF")
    assert (result.text, result.state.fault) == ("not tripped: it has no supply", "")


def test_cut_wire_silences_the_drive_that_keeps_running() -> None:
    bench = Bench(made := simulation("atv71", run_hz=30.0))
    pass_time(made, 4.0)
    bench.do("wire cut")
    assert made.line.ask(2, bytes.fromhex("030C810001")) is None
    assert made.drive(2).motor.frequency == pytest.approx(30.0, abs=0.5)
    bench.do("wire join")
    assert made.line.ask(2, bytes.fromhex("030C810001")) is not None


def test_low_mains_trips_undervoltage() -> None:
    bench = Bench(made := Simulation([DriveSpec("atv71", 2)]))
    volts = made.drive(2).motor.mains
    bench.do(f"mains {0.8 * volts:.0f}V")
    pass_time(made, 0.2)
    assert made.drive(2).fault is None
    bench.do(f"mains {0.5 * volts:.0f}V")
    pass_time(made, 0.2)
    assert (fault := made.drive(2).fault) is not None
    assert fault.code == "USF"


def test_load_of_120_percent_increases_the_current() -> None:
    bench = Bench(made := simulation("atv312", run_hz=50.0))
    bench.do("load 60%")
    pass_time(made, 5.0)
    before = made.drive(2).motor.current
    bench.do("load 120%")
    pass_time(made, 0.2)
    assert made.drive(2).motor.current > 1.4 * before


def test_jammed_shaft_draws_the_limit_of_current_and_overloads() -> None:
    bench = Bench(made := Simulation([DriveSpec("atv312", 2, run_hz=50.0)]))
    pass_time(made, 5.0)
    (result,) = bench.do("jam")
    pass_time(made, 0.2)
    drive = made.drive(2)
    assert result.state.jammed
    assert drive.motor.rotor == 0
    assert abs(drive.motor.torque) == pytest.approx(160)
    for _ in range(80):
        drive.step(5.0)
    assert drive.fault is not None
    assert drive.fault.code == "OLF"


def test_inertia_with_a_short_ramp_trips_overbraking() -> None:
    bench = Bench(made := simulation("atv71", run_hz=50.0, sets={"DEC": 5}))
    bench.do("inertia 8, load 0%")
    for _ in range(800):
        made.drive(2).step(0.05)
    made.drive(2).halt()
    pass_time(made, 1.0)
    assert (fault := made.drive(2).fault) is not None
    assert fault.code.upper() == "OBF"


def test_planted_slow_ramps_take_ten_times_as_long() -> None:
    usual, slow = simulation("atv312", run_hz=20.0), simulation("atv312", run_hz=20.0)
    Bench(slow).do("plant slow-ramps")
    for made in (usual, slow):
        pass_time(made, 1.0)
    assert usual.drive(2).motor.frequency == pytest.approx(10 * slow.drive(2).motor.frequency)


@pytest.mark.parametrize("family", ["atv312", "atv71", "atv21", "powerdrive"])
def test_planted_swapped_direction_turns_the_motor_the_other_way(family: str) -> None:
    bench = Bench(made := simulation(family, run_hz=20.0))
    bench.do("plant swapped-direction")
    pass_time(made, 3.0)
    assert made.drive(2).motor.rotor < -5
    assert bench.do("state")[0].state.shaft_hz < -5


@pytest.mark.parametrize(("planted", "trips"), [((), True), (("no-timeout",), False)])
def test_planted_no_timeout_never_trips(planted: tuple[str, ...], trips: bool) -> None:
    played = Exchange("atv312", sets={"TTO": 10})
    played.drive.conditions.planted.update(planted)
    played.play("> 02 06 2135 0006\n. 3")
    assert (played.drive.fault is not None) == trips


def test_planted_no_limits_accepts_values_and_references_beyond_limits() -> None:
    played = Exchange("atv21")
    beyond = "> 02 06 FA01 2EE0"  # 120 Hz, beyond FH
    played.play(f"{beyond}\n< 02 86 03")
    played.drive.conditions.planted.add("no-limits")
    played.play(f"{beyond}\n< 02 06 FA01 2EE0")


def test_planted_no_limits_runs_beyond_high_speed() -> None:
    bench = Bench(made := simulation("atv71", run_hz=50.0, sets={"HSP": 300}))
    pass_time(made, 5.0)
    assert made.drive(2).motor.frequency == pytest.approx(30.0)
    bench.do("plant no-limits")
    pass_time(made, 5.0)
    assert made.drive(2).motor.frequency > 45


def test_stop_key_coasts_and_needs_a_new_command() -> None:
    bench = Bench(made := simulation("atv312", run_hz=30.0, sets={"FR1": 1, "CD1": 1}))
    pass_time(made, 4.0)
    assert made.drive(2).motor.frequency > 20
    assert bench.do("key STOP")[0].text == "STOP: freewheel"
    pass_time(made, 0.5)
    motor = made.drive(2).motor
    assert (motor.frequency, motor.energised) == (0, False)
    assert motor.rotor > 10
    bench.do("LI1=0")
    pass_time(made, 0.1)
    bench.do("LI1=1")
    pass_time(made, 4.0)
    assert made.drive(2).motor.frequency > 20


def test_local_key_of_an_altivar_21_takes_the_motor_from_the_line() -> None:
    played = Exchange("atv21", sets={"F803": 0})
    played.play("""
        > 02 06 FA01 0BB8   # 30 Hz
        > 02 06 FA00 C400   # run by the line
        . 6
    """)
    press = played.drive.keypad
    assert press["LOC"]() == "local"
    played.play("""
        > 02 06 FA00 C000   # the line stops: ignored
        . 2
        > 02 03 FE45 0001
        < 02 03 02 0001
        > 02 03 FE46 0001
        < 02 03 02 0003
    """)
    assert played.drive.motor.frequency == pytest.approx(30.0)
    assert played.drive.raw("FD01") & 1 << 15
    press["STOP"]()
    played.play(". 6")
    assert played.drive.motor.frequency == 0
    assert press["REM"]() == "remote"
    played.play(". 0.1")
    assert not played.drive.raw("FD01") & 1 << 15
    with pytest.raises(SimulatorError, match="local only"):
        press["RUN"]()
    press["STOP"]()
    assert played.drive.fault is not None
    assert played.drive.fault.raw == 17


def test_clear_undoes_everything() -> None:
    bench = Bench(made := simulation("atv71"))
    before = bench.do("state")[0].state
    bench.do("load 120%, inertia 3, jam, mains 390V, wire cut")
    for name in PLANTS:
        bench.do(f"plant {name}")
    assert bench.do("state")[0].state.planted == tuple(sorted(PLANTS))
    bench.do("clear")
    after = bench.do("state")[0].state
    assert after._replace(mains=0.0) == before._replace(mains=0.0)
    assert made.drive(2).conditions.load is None
    assert made.drive(2).conditions.volts is None


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("2: explode", "one of trip"),
        ("2: trip", "write a value, for example trip OCF"),
        ("2: trip NOSUCH", "has no fault"),
        ("2: trip OCF forever", "write trip OCF stays"),
        ("2: load much", "for example load 120%"),
        ("2: load 900%", "up to 300"),
        ("2: inertia 0", "0.1 or more"),
        ("2: mains 180", "for example mains 180V"),
        ("2: plant a-tree", "slow-ramps"),
        ("2: clear 3", "write clear alone"),
        ("2: key LOC", "Keys: STOP"),
        ("2: jam, load", "write a value"),
        ("at 99999s: 2: jam", "latest time"),
        ("at 1s: 9: jam", "No simulated drive has address 9"),
    ],
)
def test_invalid_line_changes_nothing(line: str, why: str) -> None:
    made = simulation("atv71")
    with pytest.raises(SimulatorError, match=why):
        Bench(made).do(line)
    assert not made.drive(2).conditions.jammed


def test_every_example_of_the_table_is_accepted() -> None:
    bench = Bench(simulation("atv71", "atv21"))
    for word, command in BENCH.items():
        for value in command.takes or ("",):
            bench.check(f"{3 if word == 'key' else 2}: {word} {value}")


def test_line_with_a_time_waits_and_is_reported() -> None:
    come: list[BenchResult] = []
    seen = threading.Event()

    def report(result: BenchResult) -> None:
        come.append(result)
        if len(come) == 2:
            seen.set()

    bench = Bench(simulation("atv71"), report)
    assert bench.do("in 0.2s: 2: trip OCF") == []
    assert bench.do("at 0.1: jam") == []
    assert seen.wait(20)
    assert [result.text for result in come] == ["shaft jammed", "tripped with OCF"]
    assert come[1].time >= 0.2
    bench.close()


def test_closed_bench_discards_waiting_lines() -> None:
    bench = Bench(made := simulation("atv71"))
    bench.do("in 0.2s: jam")
    assert bench.waiting == 1
    bench.close()
    threading.Event().wait(0.4)
    assert not made.drive(2).conditions.jammed


def test_page_has_a_row_for_each_command() -> None:
    page = (ROOT / "docs" / "cli.md").read_text("utf-8")
    for word, command in BENCH.items():
        (row,) = [line for line in page.splitlines() if line.endswith(f"| {command.effect} |")]
        for value in command.takes or ("",):
            assert f"`{word} {value}".rstrip() + "`" in row
