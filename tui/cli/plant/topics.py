"""Lines and drives as retained messages of MQTT: the tree of topics and their contents.

ROOT/status          online, or offline: the last will of this program
ROOT/LINE/line       the line as JSON
ROOT/LINE/DEVICE     the last cycle of a drive as JSON, as `watch --json` prints it
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Literal

from tui.bus.api import Contact, LineCounters, LineState

from ..documents.document import DocumentPart, TimeoutField
from ..documents.drive_documents import CycleTime
from ..documents.parts import LastMinuteField, WatchedValueField
from ..shared.output import json_text, last_minute_field
from ..shared.watch_outputs import cycle_document
from .broker import level

if TYPE_CHECKING:
    from .status import DriveStatus, LineReport

ONLINE, OFFLINE = "online", "offline"
LINE_COUNTS = (
    "requests", "replies", "timeouts", "checksum", "wrong", "exceptions", "repeats", "stale",
    "bytes_out", "bytes_in", "busy_seconds",
)  # fmt: skip


class LineMessage(DocumentPart, kw_only=True):
    """The state of a line, with its counts."""

    schema: Literal[1] = 1
    line: str
    state: str
    reason: str | None
    counters: dict[str, int | float]
    last_minute: LastMinuteField


class MessageFault(DocumentPart):
    """The fault that a drive is in."""

    code: str
    name: str


class DriveMessage(DocumentPart, kw_only=True):
    """The last cycle of a drive, or the reason why there is none."""

    schema: Literal[1] = 1
    time: str | None
    line: str
    device: int
    profile: str | None
    timeout: TimeoutField | None
    values: dict[str, WatchedValueField]
    state: str | None
    direction: str | None
    error: str | None
    contact: Contact
    cycle: CycleTime | None
    fault: MessageFault | None


def status_topic(root: str) -> str:
    """Return the topic with the state of this publisher."""
    return f"{root}/status"


def line_topics(root: str, names: Iterable[str]) -> Mapping[str, str]:
    """Return the topic of each line by its name. Raises ValueError if two are the same."""
    found: dict[str, str] = {}
    for name in names:
        topic = f"{root}/{level(name)}"
        if topic in found.values():
            raise ValueError(f"Two lines would have the topic {topic}: give them different names.")
        found[name] = topic
    return found


def drive_messages(root: str, lines: Sequence[LineReport]) -> dict[str, str]:
    """Return the message of each drive by its topic."""
    return {
        f"{root}/{level(line.name)}/{drive.device}": json_text(_drive(line, drive))
        for line in lines
        for drive in line.drives
    }


def line_messages(root: str, lines: Sequence[LineReport]) -> dict[str, str]:
    """Return the message of each line by its topic."""
    return {
        f"{root}/{level(line.name)}/line": json_text(_line(line.text, line.state, line.counters))
        for line in lines
    }


def _line(text: str, state: LineState, counters: LineCounters) -> LineMessage:
    counted = asdict(counters)
    return LineMessage(
        line=text,
        state=state.status.value,
        reason=state.reason or None,
        counters={name: counted[name] for name in LINE_COUNTS},
        last_minute=last_minute_field(counters.minute, counters.minute.share),
    )


def _drive(line: LineReport, drive: DriveStatus) -> DriveMessage:
    if drive.session is None or drive.cycle is None:
        return DriveMessage(
            time=None,
            line=line.text,
            device=drive.device,
            profile=drive.session.profile.id if drive.session is not None else None,
            timeout=None,
            values={},
            state=None,
            direction=None,
            error=drive.error or "No cycle is complete yet.",
            contact=drive.contact,
            cycle=None,
            fault=None,
        )
    cycle = cycle_document(line.text, drive.session, drive.cycle)
    fault = drive.cycle.state.fault
    return DriveMessage(
        time=cycle.time,
        line=cycle.line,
        device=cycle.device,
        profile=cycle.profile,
        timeout=cycle.timeout or None,
        values=cycle.values,
        state=cycle.state,
        direction=cycle.direction,
        error=cycle.error,
        contact=cycle.contact,
        cycle=cycle.cycle,
        fault=MessageFault(code=fault.code, name=fault.name) if fault is not None else None,
    )
