"""Commands of the bench: supply, wire, load, faults and planted defects of one drive."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from .drive import SimulatedDrive
from .errors import SimulatorError
from .plant.conditions import PLANTS
from .plant.fault_history import fault_raw

NORMAL = "normal"
CAUSE_STAYS = "stays"
MOST_LOAD, MOST_INERTIA, MOST_VOLTS = 3.0, 100.0, 2000.0
"""Greatest load (rated torque), inertia (the usual one) and supply in V."""
_NUMBER = r"(\d{1,6}(?:\.\d{1,6})?)"
_PERCENT = re.compile(rf"{_NUMBER}\s*%")
_VOLTS = re.compile(rf"{_NUMBER}\s*V", re.IGNORECASE)
_PLAIN = re.compile(_NUMBER)

Deed = Callable[[], str]
"""Change of one drive, checked before; it returns the result as text."""


class BenchState(NamedTuple):
    """State of one drive as its bench knows it, whatever the drive shows on its line."""

    powered: bool
    fault: str
    """Code of the present fault; empty for none."""
    output_hz: float
    shaft_hz: float
    """Speed of the shaft, as a frequency, signed by its direction."""
    current: float
    mains: float
    wire_cut: bool
    jammed: bool
    planted: tuple[str, ...]


class BenchCommand(NamedTuple):
    """Command of a bench: its value, its effect, and how it is checked and carried out."""

    takes: tuple[str, ...]
    """Examples or choices of its value; none if it takes no value."""
    effect: str
    prepare: Callable[[SimulatedDrive, str], Deed]
    """Check a value for a drive; raises SimulatorError. The deed it returns does not."""


def _chosen(value: str, choices: Sequence[str], word: str) -> str:
    wanted = next((c for c in choices if c.casefold() == value.casefold()), None)
    if wanted is None:
        raise SimulatorError(f"'{word} {value}': write {word} {', '.join(choices)}.")
    return wanted


def _quantity(value: str, form: re.Pattern[str], most: float, word: str, example: str) -> float:
    match = form.fullmatch(value)
    if match is None or float(match[1]) > most:
        raise SimulatorError(
            f"'{word} {value}': write a value up to {most:g}, for example {word} {example}."
        )
    return float(match[1])


def _trip(drive: SimulatedDrive, value: str) -> Deed:
    code, _, stays = value.partition(" ")
    if stays:
        _chosen(stays.strip(), (CAUSE_STAYS,), f"trip {code}")
    fault_raw(drive.profile, code)

    def trip() -> str:
        if not drive.conditions.powered:
            return "not tripped: it has no supply"
        if (fault := drive.fault) is not None:
            return f"not tripped: it is in fault {fault.code}"
        drive.provoke(code, persists=bool(stays))
        return f"tripped with {drive.fault.code if drive.fault else code}"

    return trip


def _power(drive: SimulatedDrive, value: str) -> Deed:
    on = _chosen(value, ("on", "off"), "power") == "on"

    def power() -> str:
        if on != drive.conditions.powered:
            (drive.power_on if on else drive.power_off)()
        return "power on" if on else "power off"

    return power


def _wire(drive: SimulatedDrive, value: str) -> Deed:
    cut = _chosen(value, ("cut", "join"), "wire") == "cut"
    return partial(_put, drive, "wire_cut", cut, "wire cut" if cut else "wire joined")


def _put(drive: SimulatedDrive, name: str, value: object, text: str) -> str:
    setattr(drive.conditions, name, value)
    return text


def _load(drive: SimulatedDrive, value: str) -> Deed:
    if value.casefold() == NORMAL:
        return partial(_put, drive, "load", None, "load normal")
    percent = _quantity(value, _PERCENT, 100 * MOST_LOAD, "load", "120%")
    return partial(_put, drive, "load", percent / 100, f"load {percent:g} %")


def _inertia(drive: SimulatedDrive, value: str) -> Deed:
    factor = _quantity(value, _PLAIN, MOST_INERTIA, "inertia", "3")
    if factor < 0.1:
        raise SimulatorError(f"'inertia {value}': write 0.1 or more; 1 is the usual inertia.")
    return partial(_put, drive, "inertia", factor, f"inertia {factor:g} times the usual one")


def _jam(drive: SimulatedDrive, value: str) -> Deed:
    jammed = not value or _chosen(value, ("on", "off"), "jam") == "on"
    return partial(_put, drive, "jammed", jammed, "shaft jammed" if jammed else "shaft free")


def _mains(drive: SimulatedDrive, value: str) -> Deed:
    if value.casefold() == NORMAL:
        return partial(_put, drive, "volts", None, "mains normal")
    volts = _quantity(value, _VOLTS, MOST_VOLTS, "mains", "180V")
    return partial(_put, drive, "volts", volts, f"mains {volts:g} V")


def _plant(drive: SimulatedDrive, value: str) -> Deed:
    name = _chosen(value, tuple(PLANTS), "plant")

    def plant() -> str:
        drive.conditions.planted.add(name)
        return f"planted {name}"

    return plant


def _key(drive: SimulatedDrive, value: str) -> Deed:
    name = next((name for name in drive.keypad if name.casefold() == value.casefold()), None)
    if name is None:
        known = ", ".join(drive.keypad) or "none are simulated"
        raise SimulatorError(f"'key {value}': {drive.profile.name} has no such key. Keys: {known}.")
    press = drive.keypad[name]

    def key() -> str:
        if not drive.conditions.powered:
            return "no key pressed: it has no supply"
        try:
            return press()
        except SimulatorError as error:
            return str(error)

    return key


def _clear(drive: SimulatedDrive, value: str) -> Deed:
    _no_value(value, "clear")

    def clear() -> str:
        drive.conditions.reset()
        drive.clear_cause()
        if (fault := drive.fault) is None:
            return "cleared"
        return f"cleared; reset fault {fault.code} to go on"

    return clear


def _no_value(value: str, word: str) -> None:
    if value:
        raise SimulatorError(f"'{word} {value}': write {word} alone.")


def _state(drive: SimulatedDrive, value: str) -> Deed:
    _no_value(value, "state")

    def state() -> str:
        now = bench_state(drive)
        parts = [
            "power on" if now.powered else "power off",
            f"fault {now.fault}" if now.fault else "no fault",
            f"output {now.output_hz:.1f} Hz",
            f"shaft {now.shaft_hz:.1f} Hz",
            f"{now.current:.1f} A",
            f"mains {now.mains:.0f} V",
        ]
        parts += [text for holds, text in ((now.wire_cut, "wire cut"), (now.jammed, "jammed"))
                  if holds]  # fmt: skip
        return ", ".join([*parts, *(f"planted {name}" for name in now.planted)])

    return state


BENCH: Mapping[str, BenchCommand] = {
    "trip": BenchCommand(
        ("OCF", f"OCF {CAUSE_STAYS}"),
        "Trip the drive with a fault; with `stays`, resets fail until `clear`.",
        _trip,
    ),
    "power": BenchCommand(("off", "on"), "Switch the drive's supply.", _power),
    "wire": BenchCommand(("cut", "join"), "Cut or join the drive's wire to the line.", _wire),
    "mains": BenchCommand(
        ("180V", NORMAL), "Set the supply voltage; below 70 % the drive trips.", _mains
    ),
    "key": BenchCommand(
        ("STOP", "LOC", "REM", "RUN"),
        "Press a key of the keypad. LOC and REM are the switch to local control and back.",
        _key,
    ),
    "load": BenchCommand(
        ("120%", NORMAL), "Set the load at rated speed, in rated torque.", _load
    ),
    "inertia": BenchCommand(
        ("3", "1"), "Set the load's inertia, as a multiple of the usual one.", _inertia
    ),
    "jam": BenchCommand(("", "off"), "Block the shaft, or free it.", _jam),
    "plant": BenchCommand(tuple(PLANTS), "Plant a defect for an acceptance test to find.", _plant),
    "clear": BenchCommand(
        (), "Undo all of these, and remove the cause of a fault; the fault stays until reset.",
        _clear,
    ),
    "state": BenchCommand((), "Show the real state of the drive, its motor and its load.", _state),
}  # fmt: skip
"""Commands by their word."""


def bench_state(drive: SimulatedDrive) -> BenchState:
    """Return the real state of a drive and its motor."""
    motor, fault, given = drive.motor, drive.fault, drive.conditions
    return BenchState(
        drive.conditions.powered,
        fault.code if fault else "",
        motor.frequency,
        motor.rotor,
        motor.current,
        motor.mains,
        given.wire_cut,
        given.jammed,
        tuple(sorted(given.planted)),
    )


def prepared(drive: SimulatedDrive, part: str) -> Deed:
    """Check a part of a line for a drive; raises SimulatorError."""
    name, sign, value = part.partition("=")
    if sign:
        drive.terminals.check(name, value)
        return partial(drive.set_input, name, value)
    word, _, value = part.partition(" ")
    command = BENCH.get(word.casefold())
    if command is None:
        raise SimulatorError(
            f"{part!r}: write an input like LI1=1 or AI1=5V, or one of {', '.join(BENCH)}."
        )
    if command.takes and "" not in command.takes and not value.strip():
        raise SimulatorError(f"{part!r}: write a value, for example {word} {command.takes[0]}.")
    return command.prepare(drive, value.strip())
