"""File of an acceptance test: read and checked, each fault with its line and key."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.converting import converted
from tui.drive.profile.form import form_faults
from tui.drive.profile.person_file import raise_faults, read_person_file
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.sentences import any_of, without_stop
from tui.drive.settings.parameter_set import ParameterSet, SetError
from tui.drive.settings.set_file import read_set
from tui.drive.units import factor_between

from .steps import (
    MOST_STEPS,
    STEP_KINDS,
    AcceptanceStep,
    AcceptanceTest,
    CommunicationLossStep,
    DirectionStep,
    LimitStep,
    MotionStep,
    RampStep,
    SettingsStep,
    SpeedsStep,
    StopStep,
    moves_motor,
)

STEPS_KEY = "steps"
MEASURED: Mapping[Quantity, str] = {
    "output_frequency": "Output frequency",
    "motor_current": "Motor current",
    "motor_voltage": "Motor voltage",
    "torque": "Torque",
    "motor_thermal": "Motor thermal state",
    "drive_thermal": "Drive thermal state",
    "motor_load": "Motor load",
    "drive_load": "Drive load",
    "power": "Power",
    "speed": "Speed",
}
"""Values that are reported at each speed, with their names."""
NEEDS_FREQUENCY = (RampStep, SpeedsStep, LimitStep)
NEEDS_REFERENCE = (RampStep, SpeedsStep)
STOP_METHODS = ("stop", "quick-stop", "freewheel", "emergency-stop")


class AcceptanceFileError(DriveError):
    """Faults of a test file, one a line, each with file and line."""


@dataclass(frozen=True, slots=True)
class AcceptanceFile:
    """A test with its steps, its profile and the sets that it names."""

    path: Path
    test: AcceptanceTest
    steps: tuple[AcceptanceStep, ...]
    profile: Profile
    sets: Mapping[int, ParameterSet]
    """Parameter sets by the index of their step."""
    text: str

    @property
    def moves(self) -> bool:
        """True if a step runs the motor."""
        return any(map(moves_motor, self.steps))


def read_test(path: Path) -> AcceptanceFile:
    """Read and check a test file and the sets that it names. Raises AcceptanceFileError."""
    text, tables = read_person_file(path, AcceptanceFileError)
    return _Checked(path, text, tables).file()


class _Checked:
    """One check of one file."""

    def __init__(self, path: Path, text: str, tables: dict[str, Any]) -> None:
        self.path, self.text, self.tables = path, text, tables
        self.faults: list[tuple[TomlPath, str]] = []

    def file(self) -> AcceptanceFile:
        """Return the test. Raises AcceptanceFileError with all faults."""
        head = {key: value for key, value in self.tables.items() if key != STEPS_KEY}
        found, _ = form_faults(head, AcceptanceTest)
        self.faults += found.found
        forms = list(self._step_forms())
        self._raise()
        test: AcceptanceTest = converted(head, AcceptanceTest)
        steps = tuple(converted(table, form) for table, form in forms)
        try:
            profile = library.load(test.profile)
        except DriveError as error:
            self.faults.append((("profile",), without_stop(str(error))))
            self._raise()
            raise
        sets: dict[int, ParameterSet] = {}
        for index, step in enumerate(steps):
            for key, fault in step_faults(step, profile):
                self.faults.append(((STEPS_KEY, index, key), fault))
            if isinstance(step, SettingsStep) and step.file:
                self._read_set(index, step.file, profile, sets)
        self._raise()
        return AcceptanceFile(self.path, test, steps, profile, sets, self.text)

    def _step_forms(self) -> Iterator[tuple[dict[str, Any], type[AcceptanceStep]]]:
        steps = self.tables.get(STEPS_KEY)
        if not isinstance(steps, list) or not steps:
            self.faults.append(((STEPS_KEY,), "the test has no [[steps]]"))
            return
        if len(steps) > MOST_STEPS:
            self.faults.append(((STEPS_KEY,), f"a test has at most {MOST_STEPS} steps"))
            return
        for index, table in enumerate(steps):
            kind = table.get("kind") if isinstance(table, dict) else None
            form = STEP_KINDS.get(kind) if isinstance(kind, str) else None
            if form is None:
                text = "the field `kind` is missing" if kind is None else f"{kind!r} is not a kind"
                names = ", ".join(STEP_KINDS)
                self.faults.append(((STEPS_KEY, index, "kind"), f"{text}. Allowed: {names}"))
                continue
            found, _ = form_faults(table, form)
            self.faults += [((STEPS_KEY, index, *path), fault) for path, fault in found.found]
            yield table, form

    def _read_set(
        self, index: int, name: str, profile: Profile, sets: dict[int, ParameterSet]
    ) -> None:
        place: TomlPath = (STEPS_KEY, index, "file")
        try:
            found = read_set(self.path.parent / name)
        except (SetError, DriveError) as error:
            self.faults.append((place, without_stop(str(error))))
            return
        if found.head.profile != profile.id:
            text = f"{name} is a set of {found.head.profile}, not of {profile.id}"
            self.faults.append((place, text))
            return
        sets[index] = found

    def _raise(self) -> None:
        if not self.faults:
            return
        raise_faults(self.path, self.text, self.faults, {STEPS_KEY: "step"}, AcceptanceFileError)


def step_faults(step: AcceptanceStep, profile: Profile) -> Iterator[tuple[str, str]]:
    """Yield the faults of a step for a family, each with its key."""
    if isinstance(step, SettingsStep):
        yield from _settings_faults(step, profile)
    if isinstance(step, NEEDS_FREQUENCY) and profile.quantity("output_frequency") is None:
        yield "kind", f"{profile.name} has no output frequency that Drive Panel can read"
    if isinstance(step, MotionStep) and moves_motor(step):
        yield from _motion_faults(step, profile)
    if isinstance(step, DirectionStep) and not step.turns and not _reports_direction(profile):
        yield "kind", f"{profile.name} reports no direction: the field `turns` is missing"
    if isinstance(step, SpeedsStep):
        yield from (("limits", fault) for fault in _limit_faults(step, profile))
    if isinstance(step, RampStep) and step.up is None and step.down is None:
        yield "kind", "a ramp needs `up`, `down` or both"
    if isinstance(step, StopStep) and step.min > step.max:
        yield "min", f"{step.min:g} is more than max = {step.max:g}"
    if isinstance(step, CommunicationLossStep):
        yield from _loss_faults(step, profile)


def _limit_faults(step: SpeedsStep, profile: Profile) -> Iterator[str]:
    known: dict[str, Parameter] = {
        quantity: parameter
        for quantity in MEASURED
        if (parameter := profile.quantity(quantity)) is not None
    }
    for name, limits in step.limits.items():
        if (parameter := known.get(name)) is None:
            yield f"{name!r} is not a value of {profile.name}. It has {any_of(list(known))}"
            continue
        unit = parameter.unit
        # a share may be shown in the unit of its rating, and some units follow from a setting
        is_open = not unit or unit == "%" or parameter.unit_by or parameter.code in profile.taught
        if not is_open and factor_between(limits.unit, unit) != 1:
            yield f"{name} is in {unit} here, not in {limits.unit!r}"


def _reports_direction(profile: Profile) -> bool:
    has_bit = any(chart.direction is not None for chart in profile.data.charts)
    return has_bit or profile.quantity("output_frequency") is not None


def _settings_faults(step: SettingsStep, profile: Profile) -> Iterator[tuple[str, str]]:
    if not step.file and not step.values:
        yield "kind", "name a `file` or `values`"
    for key, codes in (("values", list(step.values)), ("ignore", step.ignore)):
        for code in codes:
            if profile.get(code) is None:
                yield key, f"{code!r} is not a parameter of {profile.name}"


def _motion_faults(step: MotionStep, profile: Profile) -> Iterator[tuple[str, str]]:
    has_word = profile.quantity("command_frequency") is not None
    orders = {order.id for chart in profile.data.charts for order in chart.orders}
    if step.direction not in orders:
        yield "direction", f"{profile.name} has no command {step.direction!r}"
    if isinstance(step, LimitStep):
        if step.hz is not None:
            yield "hz", "this step runs at the high speed of the drive; delete hz"
        if not has_word or profile.quantity("high_speed") is None:
            yield "kind", f"{profile.name} has no reference in Hz with a high speed"
    elif step.hz is not None and not has_word:
        yield "hz", f"Drive Panel gives {profile.name} no reference in Hz"
    elif step.hz is None and (has_word or isinstance(step, NEEDS_REFERENCE)):
        yield "kind", "the field `hz` is missing: the reference in Hz"
    if isinstance(step, StopStep) and (
        step.method not in orders or step.method not in STOP_METHODS
    ):
        known = [name for name in STOP_METHODS if name in orders]
        yield "method", f"{step.method!r} is not a stop of {profile.name}. It has {any_of(known)}"


def _loss_faults(step: CommunicationLossStep, profile: Profile) -> Iterator[tuple[str, str]]:
    rules = profile.data.communication_fault
    if rules is None or not rules.timeout:
        yield "kind", f"{profile.name} has no communication timeout"
        return
    names = [reaction.name for reaction in rules.reactions]
    if step.reaction and step.reaction not in names:
        known = f"It has {any_of(names)}" if names else "It has none to choose"
        yield "reaction", f"{step.reaction!r} is not a reaction of {profile.name}. {known}"
    if not step.turning and step.hz is not None:
        yield "hz", "the motor is at standstill in this step; delete hz, or set turning = true"
