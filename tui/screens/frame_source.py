"""Data for the frame around every screen, with the motors that a stop does not stop."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.style import Style

from tui.drive.sentences import counted
from tui.safety import LOOK_IS_OLD
from tui.session.command.stop_report import NOT_STOPPED, StopReport
from tui.widgets.palette import ALARM, ATTENTION, FAINT, FAULT, age_text
from tui.widgets.replay_bar import ReplayView
from tui.widgets.strip import BarMessage, DriveNow, FrameView, StripView

from .frame import at, with_drive
from .keys.action import BLOCKS, CONNECTION, FAULTS, PARAMETERS
from .state_words import state_cell, value_cell

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.drive_state import DriveState
    from tui.session.events import Event
    from tui.session.fleet import Fleet
    from tui.session.monitor.look import Look
    from tui.session.record.replay_line import ReplayLine
    from tui.session.shown import Shown

    from .app_port import Panel

FAILED_SHOWN = 60.0
"""Seconds for which a failed stop is shown over everything, unless its motor is at standstill."""


def not_stopped_texts(app: Panel, now: float) -> tuple[str, ...]:
    """A text for each motor that did not stop."""
    labels = {id(item.fleet): f"{item.opened.label}, " for item in app.panel_lines}
    found = []
    for fleet in app.fleets:
        line = labels.get(id(fleet), "") if len(labels) > 1 else ""
        for session in fleet.sessions:
            report = fleet.stopper.reports.get(session.device)
            if report is not None and is_not_stopped(report, session, now):
                why = report.text.removeprefix(NOT_STOPPED)
                found.append(f"NOT STOPPED, {line}drive {session.device}: {why}")
        if fleet.search is not None and fleet.search.is_stopping and fleet.search.unprobed:
            found.append(f"NOT STOPPED YET, {line}{scan_stops_text(fleet.search.unprobed)}")
    text, since = app.unreached
    if text and now - since < FAILED_SHOWN:
        found.append(text)
    return tuple(found)


def scan_stops_text(unprobed: Sequence[int]) -> str:
    """Return what a scan that stops each drive has still to do."""
    from tui.session.connect.addresses import addresses_text

    return f"addresses {addresses_text(unprobed)}: the scan goes on, and stops each drive found."


def is_not_stopped(report: StopReport, session: DriveSession, now: float) -> bool:
    """True if, as far as known, the motor has not stopped since the stop."""
    if report.phase.value == "unheeded":
        return True
    if report.phase.value != "failed" or now - report.since > FAILED_SHOWN:
        return False
    outcome = session.work.outcome
    newer = outcome is not None and outcome.kind == "done" and outcome.time > report.since
    # with an assumed profile, standstill cannot be confirmed
    return not newer and (session.guessed or session.rest_seen <= report.since)


def repeats(message: str, texts: Iterable[str]) -> bool:
    """True if a message repeats a text about a motor that did not stop."""
    head, _, why = message.partition(": ")
    return head.startswith("NOT STOPPED") and any(text.endswith(why) for text in texts)


REPLY_SHOWN = 8.0
"""Seconds for which the reply to a key is shown in a replay."""
LOAD_OVER = 2.0
"""Seconds over which the load of the line is measured."""
NO_ANSWER_YET = (
    "Drive {device}: NO ANSWER for {silent:.1f} s. Its communication timeout ends in {left:.1f} s:"
    " {does}."
)
NO_ANSWER_OVERDUE = (
    "Drive {device}: NO ANSWER for {silent:.1f} s. Its communication timeout has ended: {does}."
)
UNKNOWN_REACTION = "its reaction is not known"


class FrameSource:
    """Makes the frame's present contents; used in the panel's loop only."""

    def __init__(self, app: Panel) -> None:
        self._app = app
        self._bound: tuple[Event | None, str, DriveConsole | None] = (None, "", None)
        """The newest event, and the screen and the open drive with which it was first shown."""
        self._busy: tuple[float, float] | None = None
        self._load: float | None = None

    def view(self) -> FrameView:
        """Present contents of the frame."""
        app, fleet = self._app, self._app.fleet
        now = app.clock.monotonic()
        console = app.chosen if fleet is not None and app.chosen in fleet.consoles else None
        drive = drive_now(console, fleet, now) if console is not None and fleet else None
        strip = StripView(
            drive=drive,
            line=self._line(fleet),
            faults=sum(len(item.alarms.active) for item in app.live_fleets),
            unseen=any(item.alarms.unseen for item in app.live_fleets),
            load=self._measured(now),
            clock=app.clock.time_of_day(),
            read_only=app.read_only,
            off_record=bool(app.journal_trouble),
            trouble=fleet.health.troubles[0].signs if fleet and fleet.health.troubles else (),
            replay=self._replay(drive),
        )
        marks = _marks(console, fleet)
        news, not_stopped = (
            self._message(console, now),
            not_stopped_texts(app, app.panel_clock.monotonic()),
        )
        if news is not None and repeats(news.text, not_stopped):
            news = None
        return FrameView(strip, app.place, marks, news, not_stopped)

    def _replay(self, drive: DriveNow | None) -> ReplayView | None:
        """Return the replay that is shown; None if the drives are live."""
        replay = self._app.replay
        if replay is None:
            return None
        clock = replay.clock
        shown = replay.path.name
        if drive is not None:
            name = drive.name or drive.model
            shown = f"{drive.device} {name} was {drive.words}"
            if drive.age is not None:
                shown = f"{drive.device} {name} was read {age_text(drive.age)} before"
        events = tuple((event.utc / 1e6, event.kind) for event in replay.events)
        return ReplayView(
            clock.begin, clock.end, clock.monotonic(), clock.speed, clock.playing, shown, events
        )

    def _line(self, fleet: Fleet | None) -> str:
        if not self._app.line_label:
            hearing = self._app.hearing
            return f"{hearing} · listening" if hearing else ""
        count = len(fleet.found) if fleet else 0
        parts = [self._app.line_label]
        if count:
            parts.append(counted(count, "1 drive", "{count} drives"))
        if fleet is not None and fleet.search is not None and fleet.search.goes_on:
            parts.append(f"scan {fleet.search.text}")
        if len(self._app.panel_lines) > 1:
            parts.append(f"1 of {len(self._app.panel_lines)} lines")
        if fleet is not None and (others := fleet.line.facts.others):
            parts.append(f"shared by {len(others) + 1}")
        if fleet is not None and fleet.line.facts.unkept:
            parts.insert(0, "NO KEEPER")  # first: a narrow terminal clips the end
        return " · ".join(parts)

    def _measured(self, now: float) -> float | None:
        """Share of the last `LOAD_OVER` seconds in which the line was busy, or None."""
        opened = self._app.opened
        if opened is None:
            self._busy = self._load = None
            return None
        busy = opened.line.counters.busy_seconds
        if self._busy is None or busy < self._busy[1]:
            self._busy = (now, busy)
        since, before = self._busy
        if now - since >= LOAD_OVER:
            self._load = min(1.0, max(0.0, (busy - before) / (now - since)))
            self._busy = (now, busy)
        return self._load

    def _message(self, console: DriveConsole | None, now: float) -> BarMessage | None:
        """Return the state with priority over messages: a lost line, a silent drive."""
        holds = self._line_trouble(now) or self._not_heard() or self._trouble_below()
        if holds:
            return BarMessage(self._app.clock.time_of_day(), holds, "alarm", 0.0)
        event = self._event()
        if self._app.replay is not None:
            return self._in_replay(event, self._app.replay)
        outcome = console.session.work.outcome if console is not None else None
        if outcome is not None and outcome.kind == "working":
            return BarMessage(
                self._app.clock.time_of_day(), outcome.text, "working", now - outcome.time
            )
        if event is None:
            return None
        opened = console.device if console is not None else None
        there = event.device is not None and event.device != opened
        text = with_drive(event) if there else event.text
        message, place, keys = self._app.key_hint
        if message is event and place == self._app.place:
            text = f"{text} {keys}".strip()  # only here: keys differ between screens
        return BarMessage(at(event.wall), text, event.kind, time.time() - event.wall, there)

    def _in_replay(self, event: Event | None, replay: ReplayLine) -> BarMessage | None:
        """Return the newest message about a live line or a key; else the next recorded event."""
        age = time.time() - event.wall if event is not None else math.inf
        is_live = event is not None and event.device is not None and self._app.live_fleets
        if event is not None and (is_live or age < REPLY_SHOWN):
            text = f"LIVE: {with_drive(event)}" if is_live else event.text
            return BarMessage(at(event.wall), text, event.kind, age, there=bool(is_live))
        now = replay.clock.monotonic()
        following = next((item for item in replay.events if item.utc / 1e6 > now), None)
        if following is None:
            return None
        wall = following.utc / 1e6
        drive = f"drive {following.device}: " if following.device else ""
        text = f"Next, in {wall - now:.0f} s: {drive}{following.text}"
        return BarMessage(at(wall), text, "next", 0.0)

    def _event(self) -> Event | None:
        """Return the newest event that concerns the screen on top; None without one.

        A reply to a key stays on the screen, and with the drive, where it was shown first. On
        others the newest of the events before it is shown. The failure of a task is shown on every
        screen.
        """
        newest, place = self._app.events.newest, (self._app.place, self._app.chosen)
        if newest is not self._bound[0]:
            self._bound = newest, *place
        if newest is None or not self._is_reply(newest) or place == self._bound[1:]:
            return newest
        before = (event for event in reversed(self._app.events.events) if not self._is_reply(event))
        return next(before, None)

    def _is_reply(self, event: Event) -> bool:
        """True if an event only replies to a key; False if it is about a drive, a write or a line.

        A refusal without an error was sent nowhere. That of an older event is not known any more.
        """
        if event.kind != "refused":
            return event.kind == "told" and event.device is None
        consoles = (fleet.console(event.device) for fleet in self._app.fleets if event.device)
        outcomes = (console.session.work.outcome for console in consoles if console is not None)
        return all(o is None or o.text != event.text or o.error is None for o in outcomes)

    def _trouble_below(self) -> str:
        """The first trouble of the open lines that are not shown; empty if none."""
        now = self._app.panel_clock.monotonic()
        for line in self._app.panel_lines:
            hidden = line.opened is not self._app.opened and line.opened.replay is None
            if hidden and (
                trouble := self._line_trouble(now, line.opened) or self._not_heard(line.fleet)
            ):
                return f"{line.opened.label}: {trouble}"
        return ""

    def _line_trouble(self, now: float, other: OpenLine | None = None) -> str:
        opened = other or self._app.opened
        if opened is None:
            return ""
        state = opened.line.state
        if state.status.value not in ("lost", "connecting"):
            return ""
        since = f"{max(0.0, now - state.since):.0f} s"
        if state.status.value == "connecting":
            return f"CONNECTING for {since}. {state.reason}".rstrip()
        again = ""
        if state.next_try is not None:
            again = f" Retrying in {max(0.0, state.next_try - now):.0f} s."
        return f"LINE LOST for {since}: {state.reason}{again}"

    def _not_heard(self, other: Fleet | None = None) -> str:
        fleet = other or self._app.fleet
        warnings = fleet.line_watch.warnings() if fleet else []
        if not warnings:
            return ""
        first = min(warnings, key=lambda warning: warning.left)
        reaction = first.watch.reaction
        does = reaction.name.lower() if reaction else UNKNOWN_REACTION
        text = NO_ANSWER_YET if first.left > 0 else NO_ANSWER_OVERDUE
        return text.format(device=first.device, silent=first.silent, left=first.left, does=does)


def drive_now(console: DriveConsole, fleet: Fleet, now: float) -> DriveNow:
    """The open drive as last read, by its monitor or by the line watch."""
    session, identity = console.session, console.identity
    model = (identity.reference if identity else "") or session.profile.name
    snapshot, look = console.latest, fleet.line_watch.looks.get(session.device)
    report = fleet.stopper.reports.get(session.device)
    by_look = snapshot is None or (look is not None and look.time > snapshot.time)
    state, age, readings = _seen(console, look if by_look else None, now)
    kind, words = state_cell(session, state, report, now, readings)
    values = {
        quantity: value_cell(session, readings, quantity)
        for quantity in ("output_frequency", "frequency_reference", "motor_current")
    }
    armed = console.commander.armed_for
    return DriveNow(
        device=session.device,
        name=identity.name if identity else "",
        model=model,
        kind=kind,
        words=words,
        frequency=values["output_frequency"][0],
        reference=values["frequency_reference"][0],
        frequency_unit=values["output_frequency"][1] or "Hz",
        current=values["motor_current"][0],
        current_unit=values["motor_current"][1] or "A",
        age=age,
        armed=armed if armed is None or math.isfinite(armed) else 99.0,
        by=other_commander(fleet, session.device, state),
        family=_family(model, session.profile.id),
    )


def _family(model: str, profile: str) -> str:
    """Return the beginning of a model that is the name of its family; empty if it is not."""
    return profile.upper() if model.upper().startswith(profile.upper()) else ""


def _seen(
    console: DriveConsole, look: Look | None, now: float
) -> tuple[DriveState | None, float | None, Mapping[str, Shown]]:
    """Last state, its age in seconds if it is not current, and last readings."""
    snapshot = console.latest
    if look is not None:
        read = look.before if look.error and look.before else look
        age = max(0.0, now - read.time)
        old = age > LOOK_IS_OLD or bool(look.error)
        return read.state, age if old else None, read.readings
    if snapshot is None:
        return None, None, {}
    age = max(0.0, now - snapshot.read_at)
    lost = bool(snapshot.error) or snapshot.is_stale(now)
    return snapshot.state, age if lost else None, snapshot.readings


def other_commander(fleet: Fleet, device: int, state: DriveState | None) -> str:
    """Return the commander of a drive if it is not this panel; empty if it is, or is unknown."""
    return _commanding(fleet, device) or _commanded_by(state)


def _commanding(fleet: Fleet, device: int) -> str:
    """The other program that commands a drive; empty if none does."""
    other = fleet.line.facts.commander(device)
    return f"{other.name} {other.where}".rstrip() if other is not None else ""


def _commanded_by(state: DriveState | None) -> str:
    """Return the commander of the drive, if its chart shows that it is not the line."""
    if state is None or not state.channel or "modbus" in state.channel.casefold():
        return ""
    return state.channel


def _marks(console: DriveConsole | None, fleet: Fleet | None) -> dict[str, tuple[str, Style]]:
    """Return the marks of the tabs."""
    if fleet is None:
        return {}
    marks: dict[str, tuple[str, Style]] = {}
    device = console.device if console is not None else None
    if fleet.search is not None and fleet.search.goes_on:
        marks[CONNECTION] = ("…", FAINT)
    if fleet.health.troubles:
        marks[CONNECTION] = ("▲", ALARM)
    for fault in fleet.alarms.active:
        marks[FAULTS if fault.device == device else CONNECTION] = ("■", FAULT)
    if console is None:
        return marks
    editor = console.begun_editor
    if editor is not None and len(editor.staging.edits):
        marks[PARAMETERS] = ("●", ATTENTION)
    elif console.session.unsaved:
        marks[PARAMETERS] = ("▲", ALARM)
    blocks = console.begun_blocks
    if blocks is not None and blocks.proposals.count:
        marks[BLOCKS] = ("●", ATTENTION)
    return marks
