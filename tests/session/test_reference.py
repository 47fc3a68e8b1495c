"""References in every scale and unit that a profile may have, at a drive over a real line."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal

import pytest

from tests.mixer import (
    COMMAND,
    FINE,
    FULL_SCALE,
    HERTZ,
    MIXER,
    PERCENT,
    PERCENT_OF_FULL,
    REFERENCE,
    SCALE_BY,
    SIGNED,
    SPEED,
    VOLTS,
    WIDE,
    installed_mixer,
)
from tui.session.work import OutcomeKind

from .test_command import bench


@pytest.mark.parametrize(("mode", "raw"), [(0, 2000), (1, 200), (2, 20)])
async def test_run_with_a_scale_factor_turns_at_the_typed_frequency(mode: int, raw: int) -> None:
    installed_mixer(SCALE_BY)
    async with bench(MIXER, sets={"MODE": mode}) as made:
        made.commander.run("forward", "20Hz")
        await made.done()
        assert made.writes() == [(REFERENCE, raw), (COMMAND, 1)]
        await made.let_go_until(lambda: abs(made.drive.motor.frequency - 20) < 0.2)
        made.commander.step(Decimal(5))
        assert "Reference 25" in await made.done()
        assert made.writes()[-1] == (REFERENCE, raw * 25 // 20)


async def test_reference_whose_scale_cannot_be_read_is_not_written() -> None:
    installed_mixer(SCALE_BY)
    async with bench(MIXER, sets={"MODE": 7}) as made:
        made.commander.refer("20Hz")
        assert "its scale depends on MODE" in await made.done(OutcomeKind.REFUSED)
        made.commander.run("forward", "20Hz")
        assert "its scale depends on MODE" in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == []


async def test_start_after_the_scale_changed_is_refused() -> None:
    installed_mixer(SCALE_BY)
    async with bench(MIXER, sets={"MODE": 1}) as made:
        made.commander.refer("20Hz")
        assert await made.done() == "Reference 20.0 Hz (REF)"
        made.drive.set("MODE", 2)
        text = await made.order("forward", OutcomeKind.REFUSED)
        assert text.startswith("Not started: REF holds 200 Hz, 20 Hz was requested.")
        assert COMMAND not in [address for address, _ in made.writes()]
        assert made.drive.motor.frequency == 0


async def test_start_is_refused_if_the_scale_changes_after_the_write() -> None:
    """Another master sets it between the write and the start."""
    installed_mixer(SCALE_BY)
    async with bench(MIXER, sets={"MODE": 1}) as made:
        honest = made.line.write

        async def write(device: int, address: int, *what: object, **how: object) -> float:
            done = await honest(device, address, *what, **how)  # type: ignore[arg-type]
            made.drive.set("MODE", 0)
            return done

        made.line.write = write  # type: ignore[method-assign]
        made.commander.run("forward", "20Hz")
        text = await made.done(OutcomeKind.REFUSED)
        assert "REF holds 2.00 Hz, 20 Hz was requested" in text
        assert made.writes() == [(REFERENCE, 200)]


HIGH_RESOLUTION = 0x0200
"""Bit 9 of CMI, with which an Altivar counts references in another scale."""


@pytest.mark.parametrize("family", ["atv31", "atv312", "atv71"])
async def test_start_and_reference_are_refused_while_another_master_has_changed_the_scale(
    family: str,
) -> None:
    async with bench(family, sets={"CMI": HIGH_RESOLUTION}) as made:
        commander = made.commander
        commands: list[Callable[[], None]] = [
            lambda: commander.refer("20Hz"),
            lambda: commander.step(Decimal(5)),
            lambda: commander.order("forward"),
            lambda: commander.run("forward", "20Hz"),
            lambda: commander.check_run("forward"),
        ]
        for give in commands:
            give()
            text = await made.done(OutcomeKind.REFUSED)
            assert text.startswith("Bit 9 of CMI is set:"), text
            assert text.endswith("Clear it in the program that set it.")
        assert made.writes() == []
        assert made.drive.motor.frequency == 0
        made.drive.set("CMI", 0x0010)
        commander.run("forward", "20Hz")
        await made.done()


@pytest.mark.parametrize("family", ["atv31", "atv71"])
async def test_stop_is_sent_with_any_reference_scale(family: str) -> None:
    async with bench(family) as made:
        made.commander.run("forward", "20Hz")
        await made.done()
        made.drive.set("CMI", HIGH_RESOLUTION)
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)


async def test_drive_without_the_scale_word_can_start() -> None:
    async with bench("atv71", protects=frozenset({"CMI"})) as made:
        made.commander.run("forward", "20Hz")
        await made.done()


@pytest.mark.parametrize(
    ("reference", "typed", "raw", "text"),
    [
        (HERTZ, "20", 200, "Reference 20.0 Hz (REF)"),
        (HERTZ, "20 Hz", 200, "Reference 20.0 Hz (REF)"),
        (HERTZ, "0,02kHz", 200, "Reference 20.0 Hz (REF)"),
        (HERTZ, "900rpm", 300, "Reference 30.0 Hz (REF) for 900 rpm"),
        (PERCENT, "40", 400, "Reference 40.0 % (REF)"),
        (PERCENT, "40 %", 400, "Reference 40.0 % (REF)"),
        (PERCENT_OF_FULL, "20hz", 400, "Reference 40.0 % (REF) for 20 Hz"),
        (PERCENT_OF_FULL, "900 1/min", 600, "Reference 60.0 % (REF) for 900 1/min"),
        (PERCENT_OF_FULL, "40%", 400, "Reference 40.0 % (REF)"),
        (VOLTS, "5 V", 500, "Reference 5.00 V (REF)"),
        (VOLTS, "5000mV", 500, "Reference 5.00 V (REF)"),
        (SPEED, "900", 900, "Reference 900 rpm (REF)"),
        (SPEED, "1500RPM", 1500, "Reference 1500 rpm (REF)"),
        (SPEED, "30Hz", 900, "Reference 900 rpm (REF) for 30 Hz"),
        (FINE, "20", 16384, "Reference 20.000 Hz (REF)"),
        (FULL_SCALE, "25", 8192, "Reference 25.000 Hz (REF)"),
        (FULL_SCALE, "50%", 8192, "Reference 25.000 Hz (REF) for 50 %"),
        (FULL_SCALE, "750rpm", 8192, "Reference 25.000 Hz (REF) for 750 rpm"),
    ],
)
async def test_reference_in_any_unit_is_converted(
    reference: str, typed: str, raw: int, text: str
) -> None:
    installed_mixer(reference)
    async with bench(MIXER) as made:
        made.commander.refer(typed)
        assert await made.done() == text
        assert made.writes() == [(REFERENCE, raw)]


@pytest.mark.parametrize(
    ("reference", "typed", "hertz"),
    [(PERCENT_OF_FULL, "20Hz", 20), (SPEED, "30Hz", 30), (PERCENT, "40%", 24), (VOLTS, "5V", 30)],
)
async def test_run_in_any_unit_turns_the_motor_at_the_typed_value(
    reference: str, typed: str, hertz: float
) -> None:
    installed_mixer(reference)
    async with bench(MIXER) as made:
        made.commander.run("forward", typed)
        await made.done()
        await made.let_go_until(lambda: abs(made.drive.motor.frequency - hertz) < 0.2)


@pytest.mark.parametrize(
    ("reference", "typed", "units"),
    [
        (PERCENT, "20Hz", "REF takes its reference in %. Type it like 40%"),
        (PERCENT, "900rpm", "in %."),
        (VOLTS, "20Hz", "REF takes its reference in V. Type it like 5V"),
        (HERTZ, "40%", "REF takes its reference in Hz or rpm. Type it like 30Hz"),
        (HERTZ, "5V", "in Hz or rpm."),
        (PERCENT_OF_FULL, "5V", "in %, Hz or rpm."),
    ],
)
async def test_reference_in_an_unknown_unit_is_refused(
    reference: str, typed: str, units: str
) -> None:
    installed_mixer(reference)
    async with bench(MIXER) as made:
        made.commander.run("forward", typed)
        assert units in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == []


@pytest.mark.parametrize(
    ("reference", "typed", "text"),
    [
        (PERCENT_OF_FULL, "81%", "40.5 Hz is above HIGH = 40.0 Hz"),
        (PERCENT_OF_FULL, "9", "4.5 Hz is below LOW = 5.0 Hz"),
        (SPEED, "1201", "40.033 Hz is above HIGH = 40.0 Hz"),
        (HERTZ, "1201rpm", "40.033 Hz is above HIGH = 40.0 Hz"),
        (FINE, "40.01", "40.01 Hz is above HIGH = 40.0 Hz"),
    ],
)
async def test_limits_apply_in_their_own_unit(reference: str, typed: str, text: str) -> None:
    installed_mixer(reference)
    async with bench(MIXER, sets={"LOW": 50, "HIGH": 400}) as made:
        made.commander.refer(typed)
        assert text in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == []


@pytest.mark.parametrize(("reference", "raw"), [(PERCENT_OF_FULL, 800), (SPEED, 1200)])
async def test_step_reaches_the_limit_in_the_unit_of_the_reference(
    reference: str, raw: int
) -> None:
    installed_mixer(reference)
    async with bench(MIXER, sets={"HIGH": 400, "REF": raw - 5}) as made:
        made.commander.step(Decimal(5))
        await made.done()
        assert made.writes() == [(REFERENCE, raw)]


async def test_full_scale_of_another_parameter_gives_the_frequency_of_the_motor() -> None:
    installed_mixer(FULL_SCALE)
    async with bench(MIXER, sets={"FULL": 600}) as made:
        made.commander.run("forward", "30Hz")
        await made.done()
        assert made.writes() == [(REFERENCE, 8192), (COMMAND, 1)]
        await made.let_go_until(lambda: abs(made.drive.motor.frequency - 30) < 0.1)
        made.commander.step(Decimal(5))
        assert "34.999 Hz (REF)" in await made.done()
        assert made.writes()[-1] == (REFERENCE, 9557)


async def test_full_scale_that_changes_before_the_start_refuses_it() -> None:
    installed_mixer(FULL_SCALE)
    async with bench(MIXER) as made:
        made.commander.refer("25Hz")
        await made.done()
        made.drive.set("FULL", 1000)
        text = await made.order("forward", OutcomeKind.REFUSED)
        assert text.startswith("Not started: REF holds 50.000 Hz, 25 Hz was requested.")
        assert made.drive.motor.frequency == 0


async def test_full_scale_of_zero_lets_nothing_be_written() -> None:
    installed_mixer(FULL_SCALE)
    async with bench(MIXER, sets={"FULL": 0}) as made:
        for give in (made.commander.refer, lambda text: made.commander.run("forward", text)):
            give("20Hz")
            text = await made.done(OutcomeKind.REFUSED)
            assert "its full scale is the value of FULL, which is 0" in text
        assert made.writes() == []


async def test_reference_of_32_bits_turns_the_motor() -> None:
    installed_mixer(WIDE)
    async with bench(MIXER) as made:
        made.commander.run("forward", "25Hz")
        await made.done()
        await made.let_go_until(lambda: abs(made.drive.motor.frequency - 25) < 0.1)


async def test_signed_reference_turns_the_motor_in_the_commanded_direction() -> None:
    installed_mixer(SIGNED)
    async with bench(MIXER) as made:
        made.commander.run("reverse", "25Hz")
        await made.done()
        assert made.writes() == [(REFERENCE, 0x10000 - 8192), (COMMAND, 1)]
        await made.let_go_until(lambda: made.drive.motor.frequency < -24.9)
        made.commander.refer("20Hz")
        assert (await made.done()).startswith("Reference -20.001 Hz (REF)")
        await made.let_go_until(lambda: abs(made.drive.motor.frequency + 20) < 0.1)
        made.commander.step(Decimal(-5))
        await made.done()
        await made.let_go_until(lambda: abs(made.drive.motor.frequency + 15) < 0.1)
        await made.order("forward")
        await made.let_go_until(lambda: abs(made.drive.motor.frequency - 15) < 0.1)


async def test_signed_reference_keeps_the_direction_of_a_run_at_zero() -> None:
    installed_mixer(SIGNED)
    async with bench(MIXER) as made:
        made.commander.run("reverse", "0Hz")
        await made.done()
        made.commander.refer("25Hz")
        await made.done()
        assert made.writes()[-1] == (REFERENCE, 0x10000 - 8192)


async def test_signed_reference_of_another_program_gets_the_sign_of_the_start() -> None:
    installed_mixer(SIGNED)
    async with bench(MIXER, sets={"REF": -8192}) as made:
        await made.order("forward")
        assert made.writes() == [(REFERENCE, 8192), (COMMAND, 1)]


async def test_signed_reference_that_was_not_read_is_not_changed() -> None:
    installed_mixer(SIGNED)
    async with bench(MIXER, protects=frozenset({"REF"})) as made:
        made.commander.refer("25Hz")
        assert "its sign is the direction" in await made.done(OutcomeKind.REFUSED)
        assert made.writes() == []
