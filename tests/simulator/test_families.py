"""The families with the profiles that come with the panel: alive, plausible, as commissioned."""

from __future__ import annotations

import pytest

from tui.drive.chart import read_chart, watched_codes
from tui.drive.profile.library import load
from tui.drive.profile.schema import Parameter, Quantity
from tui.simulator import DriveSpec, SimulatedDrive

FAMILIES = ("atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca")
ALTIVAR = FAMILIES[:4]


def drive(profile: str, **more: object) -> SimulatedDrive:
    return SimulatedDrive(load(profile), DriveSpec(profile, 2, **more))  # type: ignore[arg-type]


def run(simulated: SimulatedDrive, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        simulated.step(0.05)


def state(simulated: SimulatedDrive) -> str:
    profile = simulated.profile
    raws = {code: simulated.raw(code) for code in watched_codes(profile)}
    return read_chart(profile, raws).kind


def value(simulated: SimulatedDrive, quantity: Quantity) -> float:
    parameter = simulated.profile.quantity(quantity)
    assert parameter is not None, quantity
    scale = simulated.profile.scale(parameter, {})
    return simulated.raw(parameter.code) * float(parameter.scale if scale is None else scale)


@pytest.mark.parametrize("profile", FAMILIES)
def test_default_drive_is_at_standstill_without_a_fault(profile: str) -> None:
    simulated = drive(profile)
    run(simulated, 2)
    assert simulated.fault is None
    assert simulated.motor.frequency == 0
    assert state(simulated) in ("ready", "blocked", "stopped")


@pytest.mark.parametrize("profile", FAMILIES)
def test_terminal_run_command_starts_and_stops_the_motor(profile: str) -> None:
    simulated = drive(profile, run_hz=30.0)
    run(simulated, 12)
    assert simulated.motor.frequency == pytest.approx(30, abs=0.1)
    assert state(simulated) == "running"
    simulated.halt()
    run(simulated, 12)
    assert simulated.motor.frequency == 0
    assert state(simulated) in ("ready", "blocked", "stopped")


@pytest.mark.parametrize("profile", FAMILIES)
def test_fault_is_visible_until_it_ends(profile: str) -> None:
    simulated = drive(profile)
    simulated.provoke(9)
    assert state(simulated) == "fault"
    simulated.power_cycle()
    assert state(simulated) != "fault"


@pytest.mark.parametrize("profile", ALTIVAR)
def test_values_of_a_running_motor_change_plausibly(profile: str) -> None:
    simulated = drive(profile, run_hz=40.0)
    run(simulated, 30)
    assert value(simulated, "output_frequency") == pytest.approx(40, abs=0.1)
    assert value(simulated, "frequency_reference") == pytest.approx(40, abs=0.1)
    assert 1050 < value(simulated, "speed") <= 1200
    assert value(simulated, "motor_current") > 0
    assert 20 < value(simulated, "torque") < 100
    first = [simulated.raw(p.code) for p in monitored(simulated)]
    run(simulated, 10)
    second = [simulated.raw(p.code) for p in monitored(simulated)]
    assert first != second, "a load that never changes makes a dead trend"


def monitored(simulated: SimulatedDrive) -> list[Parameter]:
    wanted: tuple[Quantity, ...] = ("motor_current", "torque", "power")
    found = [simulated.profile.quantity(q) for q in wanted]
    return [p for p in found if p is not None]


@pytest.mark.parametrize("profile", ["atv71", "atv21"])
def test_model_word_matches_the_identification(profile: str) -> None:
    simulated = drive(profile)
    identification = simulated.profile.data.identification
    raw = simulated.raw(identification.model_parameter)
    assert raw != 0
    assert raw in {model.code for model in identification.models}


@pytest.mark.parametrize("profile", FAMILIES)
def test_every_word_of_every_family_can_be_read(profile: str) -> None:
    simulated = drive(profile, run_hz=20.0)
    run(simulated, 1)
    for parameter in simulated.profile.parameters:
        request = bytes([3]) + parameter.address.to_bytes(2, "big") + b"\0\1"
        reply = simulated.line_side.answer(2, request)
        assert reply is not None, parameter.code
        assert len(reply) == 4, parameter.code


@pytest.mark.parametrize("profile", ["atv31", "atv312", "atv71"])
@pytest.mark.parametrize(("reaction", "hertz"), [(1, 0.0), (6, 20.0), (7, 0.0)])
def test_communication_loss_stops_as_set_in_sll(profile: str, reaction: int, hertz: float) -> None:
    """Freewheel, ramp stop and fast stop, half a second after the timeout of 1.0 s."""
    simulated = drive(profile, sets={"SLL": reaction, "TTO": 10})
    frequency = simulated.profile.quantity("command_frequency")
    assert frequency is not None
    for address, word in ((frequency.address, 300), (8501, 6), (8501, 7), (8501, 15)):
        body = bytes([6]) + address.to_bytes(2, "big") + word.to_bytes(2, "big")
        assert simulated.line_side.answer(2, body) == body
    for _ in range(8):
        run(simulated, 0.5)
        simulated.line_side.answer(2, bytes.fromhex("030C810001"))
    assert simulated.motor.frequency == pytest.approx(30)
    run(simulated, 1.6)
    assert simulated.motor.frequency == pytest.approx(hertz, abs=3)
    assert simulated.fault is not None
    assert simulated.fault.raw == 5
