"""The motor: a pure step with values that fit the rating."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tui.simulator.plant.motor import MotorDemand, MotorState, Shaft, approach, rating_of, step

RATING = rating_of("ATV71HU15M3")
GO = MotorDemand(energised=True, target=50.0, acceleration=10.0, deceleration=5.0)


def run(state: MotorState, order: MotorDemand, seconds: float, load: float = 0.7) -> MotorState:
    for _ in range(round(seconds / 0.05)):
        state = step(state, RATING, order, Shaft(load), 230.0, 0.05)
    return state


@pytest.mark.parametrize(
    ("reference", "power", "voltage"),
    [
        ("ATV71HU15M3", 1.5, 230),
        ("ATV21HU40N4", 4.0, 400),
        ("ATV21H075M3X", 0.75, 230),
        ("ATV31HU09M3S232", 0.9, 230),
        ("ATV312HD11N4", 11, 400),
        ("ATV21WD11N4C", 11, 400),
        ("", 4.0, 400),
    ],
)
def test_rating_is_read_from_the_model_reference(
    reference: str, power: float, voltage: float
) -> None:
    rating = rating_of(reference)
    assert rating.power == pytest.approx(power)
    assert rating.voltage == voltage


def test_a_1_5_kw_motor_at_230_v_takes_about_6_a_from_a_drive_of_about_8_a() -> None:
    assert 5 < RATING.current < 7
    assert 7 < RATING.drive_current < 9


def test_ramp_takes_its_time_up_and_down() -> None:
    state = run(MotorState(), GO, 2.5)
    assert state.frequency == pytest.approx(25)
    state = run(state, GO, 2.5)
    assert state.frequency == pytest.approx(50)
    state = run(state, replace(GO, target=0.0), 5)
    assert state.frequency == pytest.approx(25)


def test_reversing_passes_zero() -> None:
    passed = approach(1.0, MotorDemand(True, -50.0, acceleration=10.0, deceleration=20.0), 0.1)
    assert passed == 0.0
    assert approach(0.0, MotorDemand(True, -50.0, acceleration=10.0), 0.1) == pytest.approx(-1.0)


def test_values_at_rated_speed_match_the_rating() -> None:
    state = run(MotorState(), GO, 20)
    assert 0.6 * RATING.current < state.current < RATING.current
    assert state.voltage == pytest.approx(230)
    assert state.torque == pytest.approx(70)
    assert 0.9 < state.power < 1.2
    assert state.power < state.input_power < 1.5
    assert 300 < state.dc_bus < 330
    assert 1400 < state.rotor * 30 < 1500


def test_more_load_increases_current_and_slip() -> None:
    light, heavy = run(MotorState(), GO, 20, load=0.3), run(MotorState(), GO, 20, load=1.0)
    assert light.current < heavy.current
    assert light.rotor > heavy.rotor


def test_accelerating_needs_torque_and_braking_regenerates() -> None:
    accelerating = run(MotorState(), GO, 3)
    at_speed = run(MotorState(), GO, 20)
    fast = replace(GO, target=0.0, deceleration=60.0)
    braking = run(at_speed, fast, 0.4)
    assert accelerating.current > run(MotorState(), replace(GO, target=29.0), 20).current
    assert braking.torque < 0
    assert braking.power < 0
    assert braking.dc_bus > at_speed.dc_bus


def test_motor_without_output_coasts() -> None:
    state = run(run(MotorState(), GO, 10), MotorDemand(), 1)
    assert (state.frequency, state.current, state.voltage) == (0, 0, 0)
    assert 20 < state.rotor < 45
    assert run(state, MotorDemand(), 60).rotor == 0


def test_dc_injection_stops_faster_than_coasting_and_draws_current() -> None:
    turning = run(MotorState(), GO, 10)
    braked = run(turning, MotorDemand(injection=True), 1)
    assert 0 < braked.rotor < run(turning, MotorDemand(), 1).rotor
    assert braked.current > 0
    assert braked.braking


def test_thermal_states_rise_slowly_and_fall_again() -> None:
    cold = MotorState()
    warm = run(cold, GO, 120)
    hot = run(warm, GO, 1200)
    assert cold.motor_thermal < warm.motor_thermal < hot.motor_thermal < 100
    assert run(hot, MotorDemand(), 600).motor_thermal < hot.motor_thermal
    assert hot.drive_thermal > cold.drive_thermal


def test_energy_and_hours_add_up() -> None:
    state = run(MotorState(), GO, 360)
    assert state.run_hours == pytest.approx(0.1, rel=0.01)
    assert state.on_hours == pytest.approx(0.1, rel=0.01)
    assert 0.08 < state.energy < 0.16
    idle = run(state, MotorDemand(), 360)
    assert idle.run_hours == state.run_hours
    assert idle.on_hours == pytest.approx(0.2, rel=0.01)


def test_long_step_equals_many_short_ones() -> None:
    once = step(MotorState(), RATING, GO, Shaft(0.7), 230.0, 2.5)
    assert once.frequency == pytest.approx(25)
    assert once.motor_thermal == pytest.approx(run(MotorState(), GO, 2.5).motor_thermal)
