"""State of a drive, its commander, and its reaction to lost polling: read and reported."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tui.drive.channel import switch_texts
from tui.drive.chart import watched_codes
from tui.drive.command_blocked import blocked_reason, state_refusal
from tui.drive.communication_words import communication_words
from tui.drive.hints import alarm_words
from tui.drive.orders import chart_in_force, deciding_codes, interlock_codes
from tui.drive.values import NOT_AVAILABLE
from tui.session.clock import patience
from tui.session.reading import Reading, with_text

from .control import control_field, control_row
from .errors import DONE, DRIVE_REFUSED, LINE_TROUBLE
from .fault_output import (
    FaultFinding,
    alarm_field,
    alarms_text,
    direction_row,
    fault_field,
    fault_rows,
    fault_text,
    find_out,
)
from .left_behind import LeftBehind, left_behind
from .pending_timeouts import timeout_field, watch_field, watch_text
from .rows import Column
from .status_words import eeprom_counts, eeprom_field, eeprom_rows, word_fields, word_rows

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.drive.profile.schema import Quantity
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.drive_state import DriveState
    from tui.session.eeprom_counts import DriveCounts
    from tui.session.timeout_report import Timeout, TimeoutWatch

    from ..documents.drive_documents import StatusDocument
    from ..documents.parts import ValueField

log = logging.getLogger(__name__)

STATUS_WITHIN = 6.0
"""Seconds in which the words of a drive are read; more on a slow line. With the time to open the
line and to identify the drive, `status` ends within 10 s."""
FINDING_WITHIN = 1.0
"""Seconds more in which the words are read to which a fault points."""

SHOWN_QUANTITIES: dict[Quantity, str] = {
    "output_frequency": "Output frequency",
    "frequency_reference": "Reference",
    "motor_current": "Current",
}
"""Quantities that show how a motor turns, with their names here."""
LINE_FIGURES = ("Output frequency", "Current")
"""Quantities in the one line of a drive."""
LINE_COLUMNS = (
    Column("Device", width=3, right=True),
    Column("Model", width=18, most=18),
    Column("State", width=18, most=18),
    *(Column(name, width=9, right=True) for name in LINE_FIGURES),
    Column("Fault"),
)
CHANNEL_NAMES: dict[Quantity, str] = {
    "command_channel": "Commanded by",
    "reference_channel": "Reference from",
}


@dataclass(frozen=True, slots=True)
class Status:
    """Everything that `status` shows about one drive."""

    session: DriveSession
    state: DriveState
    readings: Mapping[str, Reading]
    channels: Mapping[str, str]
    switches: Sequence[str]
    """Possible channel changes, as sentences."""
    refused: str
    """Why a run command from here would have no effect; empty where it would have one."""
    watch: TimeoutWatch | None
    timeout: Timeout
    """Its timeout as it was known when `unread` was settled; it may be learnt later."""
    left: LeftBehind | None = None
    """Its motor, if the program that started it has exited and no program commands it."""
    finding: FaultFinding | None = None
    """Probable causes of its fault or alarm; None without either."""
    unread: Sequence[str] = ()
    """Codes of words that could not be read in time."""
    eeprom: DriveCounts | None = None
    """Writes to its EEPROM; None if they cannot be read."""

    refused_words: Sequence[str] = ()
    """Those of `unread` that show the state or the fault, and that the drive refused."""

    @property
    def status(self) -> int:
        """The exit status: 3 if something could not be read, 4 if the drive refused its state."""
        if self.refused_words:
            return DRIVE_REFUSED
        return LINE_TROUBLE if self.unread else DONE


def shown_codes(profile: Profile) -> list[str]:
    """Codes of the SHOWN quantities that the profile has, and of learned scales."""
    found = (profile.quantity(quantity) for quantity in SHOWN_QUANTITIES)
    codes = [parameter.code for parameter in found if parameter is not None]
    return [*codes, *(code for code in profile.taught if code not in codes)]


def shown_values(profile: Profile, readings: Mapping[str, Reading]) -> dict[str, str]:
    """Return the SHOWN values by name, with units; `-----` if not read just now."""
    values = {}
    for quantity, name in SHOWN_QUANTITIES.items():
        parameter = profile.quantity(quantity)
        if parameter is not None:
            values[name] = _text(readings.get(parameter.code))
    for code in profile.taught:
        values[code] = f"{profile[code].name} {_text(readings.get(code))}"
    return values


def _text(reading: Reading | None) -> str:
    if reading is None or reading.raw is None or reading.quality != "good":
        return "-----"
    text = f"{reading.text} {reading.unit}".strip()
    is_taught = reading.value is not None and reading.value.taught
    return f"{text} taught" if is_taught else text


async def status_of_drive(session: DriveSession, opened: OpenLine) -> Status:
    """Read all that `status` shows, and mark values that do not arrive within `STATUS_WITHIN`.

    Raises the line's errors if no value arrives.
    """
    from tui.bus.errors import ExchangeError
    from tui.session.drive_state import drive_state
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal
    from tui.session.monitor.timeout import timeout_now
    from tui.session.running.watching import NotLearned, learned_timeout

    profile = session.profile
    fleet = Fleet(opened.line, Journal())
    console = fleet.take(session)
    rules = profile.data.communication_fault
    end = asyncio.get_running_loop().time() + patience(opened.line, STATUS_WITHIN)
    watch = finding = None
    is_late = False
    try:
        readings, unread = await read_until(console, _codes(profile), end)
        try:
            async with asyncio.timeout_at(end):
                watch = await learned_timeout(fleet, console)
        except (NotLearned, TimeoutError):
            is_late = True
        state = drive_state(profile, readings)
        try:
            async with asyncio.timeout_at(end + FINDING_WITHIN):
                finding = await find_out(console, state, readings)
        except (ExchangeError, TimeoutError) as error:
            log.warning("advice on device %s was not read: %s", session.device, error)
    finally:
        fleet.forget()
    timeout = timeout_now(session)
    if is_late and timeout.known:  # it was known before, or arrived late
        watch = timeout.watch
    elif is_late:
        unread.append(rules.timeout if rules is not None else "")
    refused_words = _refused_words(profile, state, readings)
    unread += [code for code in refused_words if code not in unread]
    channels = _channels(profile, readings, state)
    switches = switch_texts(profile, session.image.raws)
    refused = _refused(session)
    left = await asyncio.to_thread(left_behind, session, state.motion)
    return Status(
        session, state, readings, channels, switches, refused, watch, timeout, left, finding,
        unread, await eeprom_counts(session, fleet.journal), refused_words,
    )  # fmt: skip


def _refused_words(
    profile: Profile, state: DriveState, readings: Mapping[str, Reading]
) -> list[str]:
    """Return the codes without which the state or the fault is not known, and that were refused."""
    codes: list[str] = []
    if state.kind == "unknown":
        codes += watched_codes(profile)
    elif state.kind == "fault" and state.fault is None:
        codes.append(profile.data.faults.parameter)
    return [c for c in codes if (reading := readings.get(c)) is not None and reading.raw is None]


def _codes(profile: Profile) -> list[str]:
    channels = [profile.quantity(quantity) for quantity in CHANNEL_NAMES]
    codes = [*watched_codes(profile), profile.data.faults.parameter, *shown_codes(profile)]
    codes += [parameter.code for parameter in channels if parameter is not None]
    codes += [parameter.code for parameter in communication_words(profile).values()]
    codes += alarm_words(profile)
    codes += deciding_codes(profile)
    for chart in profile.data.charts:
        codes += interlock_codes(chart)
    return list(dict.fromkeys(code for code in codes if code))


def _channels(
    profile: Profile, readings: Mapping[str, Reading], state: DriveState
) -> dict[str, str]:
    from tui.session.drive_state import channel_text

    found = {}
    for quantity, name in CHANNEL_NAMES.items():
        parameter = profile.quantity(quantity)
        reading = readings.get(parameter.code) if parameter else None
        value = reading.value if reading is not None else None
        found[name] = channel_text(parameter, value) if parameter and value else ""
    # some families tell who commands by several words
    found["Commanded by"] = state.channel or found["Commanded by"]
    found["Reference from"] = state.reference or found["Reference from"]
    return found


def _channel_rows(profile: Profile, channels: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return a row for each channel; none for one that the family does not report."""
    shown = {
        "Commanded by": profile.data.channels.command
        or profile.quantity("command_channel")
        or any(chart.channel for chart in profile.data.charts),
        "Reference from": profile.data.channels.reference or profile.quantity("reference_channel"),
    }
    return [(name, text or "not known") for name, text in channels.items() if text or shown[name]]


def _refused(session: DriveSession) -> str:
    from tui.session.command.unblock_hint import block_reason_text

    raws = session.image.raws
    chart = chart_in_force(session.profile, raws)
    if chart is None:
        return "Its command source could not be read."
    if not chart.orders:
        return f"Drive Panel does not command this drive: {chart.name}."
    if session.line.read_only:
        return "The line is read-only: nothing is written."
    held = blocked_reason(session.profile, chart, "forward", raws)
    if held is not None:
        return block_reason_text(held)
    return state_refusal(session.profile, chart, "forward", raws)


def status_document(line_text: str, status: Status) -> StatusDocument:
    """The document of `status`."""
    from ..documents.drive_documents import StatusDocument
    from ..documents.parts import LeftBehindDocument, StateField
    from .output import drive_fields

    state = status.state
    fields = drive_fields(line_text, status.session)
    fields["timeout"] = timeout_field(status.timeout)
    return StatusDocument(
        **fields,
        state=StateField(id=state.id, name=state.name, kind=state.kind),
        direction=state.direction,
        fault=fault_field(state, status.finding),
        alarms=[bit.name for bit in state.alarms],
        alarm=alarm_field(status.finding),
        commanded_by=status.channels["Commanded by"] or None,
        reference_from=status.channels["Reference from"] or None,
        switched_by=list(status.switches),
        commandable=not status.refused,
        why_not=status.refused or None,
        control=control_field(status.session),
        watch=watch_field(status.watch),
        left_behind=LeftBehindDocument(**status.left.fields()) if status.left else None,
        words=word_fields(status.session.profile, status.readings),
        values=shown_fields(status.session.profile, status.readings),
        unread=list(status.unread),
        eeprom=eeprom_field(status.session, status.eeprom),
    )


def shown_fields(profile: Profile, readings: Mapping[str, Reading]) -> dict[str, ValueField | None]:
    """Return the SHOWN values by quantity; null if the family lacks it or it was not read.

    Taught scales are stored there by their code.
    """
    from .output import value_field

    values: dict[str, ValueField | None] = {}
    for quantity in SHOWN_QUANTITIES:
        parameter = profile.quantity(quantity)
        reading = readings.get(parameter.code) if parameter else None
        values[quantity] = value_field(reading) if reading is not None else None
    for code in profile.taught:
        values[code] = value_field(readings[code]) if code in readings else None
    return values


def status_table(status: Status) -> list[tuple[str, str]]:
    """Titles and texts of `status` for a person."""
    state, profile = status.state, status.session.profile
    found = fault_rows(status.finding)
    is_alarm = status.finding is not None and bool(status.finding.alarm)
    return [
        ("Device", f"{status.session.device}, {profile.name}"),
        ("State", f"{state.headline} ({state.name})"),
        *direction_row(profile, state),
        *([("Left behind", status.left.sentence(status.session.line_text))] if status.left else []),
        ("Fault", fault_text(profile, state) or "none"),
        *([] if is_alarm else found),
        ("Alarms", alarms_text(profile, state, status.readings)),
        *(found if is_alarm else []),
        *_channel_rows(profile, status.channels),
        *(("Besides", text) for text in status.switches),
        ("Commands", status.refused or "commands can have an effect"),
        ("Comm. timeout", _time_out_text(status)),
        *control_row(status.session),
        *word_rows(profile, status.readings),
        *shown_values(profile, status.readings).items(),
        *eeprom_rows(status.session, status.eeprom),
        *([("Not read", ", ".join(status.unread))] if status.unread else []),
    ]


def _time_out_text(status: Status) -> str:
    rules = status.session.profile.data.communication_fault
    if rules is not None and rules.timeout in status.unread:
        return f"not known: {rules.timeout} was not read"
    if not status.timeout.known:
        return "cannot be read: the drive may react when polling stops"
    if rules is None and status.session.profile.data.profile.unproved:
        return "not known: the drive may react when polling stops"
    return watch_text(status.watch)


def drive_cells(status: Status) -> tuple[str, ...]:
    """Return the cells of a drive for LINE_COLUMNS."""
    session, state = status.session, status.state
    shown = shown_values(session.profile, status.readings)
    figures = (shown.get(name, NOT_AVAILABLE) for name in LINE_FIGURES)
    name = session.known_identity.reference or session.profile.name
    return (str(session.device), name, state.headline, *figures, fault_text(session.profile, state))


async def read_until(
    console: DriveConsole, codes: Sequence[str], end: float
) -> tuple[dict[str, Reading], list[str]]:
    """Readings by code, the state first, and the codes that did not arrive in time.

    `end` is a time of the loop. Raises the line's errors if nothing comes.
    """
    from tui.bus.errors import ExchangeError
    from tui.session.read.reader import Reader

    readings: dict[str, Reading] = {}
    failure: Exception | None = None
    for group in sorted(Reader(console.session).groups(codes), key=lambda g: codes.index(g[0])):
        try:
            async with asyncio.timeout_at(end):
                readings |= with_text(await console.read(group))
        except (ExchangeError, TimeoutError) as error:
            if failure is not None and not readings:
                raise failure from error
            failure = error
    if failure is not None and not readings:
        raise failure
    return readings, [code for code in codes if code not in readings]
