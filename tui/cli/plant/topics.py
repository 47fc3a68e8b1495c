"""Lines and drives as retained messages of MQTT: the tree of topics and their contents.

ROOT/status          online, or offline: the last will of this program
ROOT/LINE/line       the line as JSON
ROOT/LINE/DEVICE     the last cycle of a drive as JSON, as `watch --json` prints it
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from ..shared.output import JSON_SCHEMA, json_text, minute_json
from ..shared.watch_outputs import cycle_json
from .broker import level

if TYPE_CHECKING:
    from tui.bus.api import LineCounters, LineState

    from .status import DriveStatus, LineReport

ONLINE, OFFLINE = "online", "offline"
LINE_COUNTS = (
    "requests", "replies", "timeouts", "checksum", "wrong", "exceptions", "repeats", "stale",
    "bytes_out", "bytes_in", "busy_seconds",
)  # fmt: skip


def status_topic(root: str) -> str:
    """Return the topic with the state of this publisher."""
    return f"{root}/status"


def line_topics(root: str, names: Iterable[str]) -> Mapping[str, str]:
    """The topic of each line by its name. Raises ValueError where two have the same."""
    found: dict[str, str] = {}
    for name in names:
        topic = f"{root}/{level(name)}"
        if topic in found.values():
            raise ValueError(f"two lines would be published under {topic}: give them names")
        found[name] = topic
    return found


def drive_messages(root: str, lines: Sequence[LineReport]) -> dict[str, str]:
    """The message of each drive, by its topic."""
    return {
        f"{root}/{level(line.name)}/{drive.device}": json_text(_drive(line, drive))
        for line in lines
        for drive in line.drives
    }


def line_messages(root: str, lines: Sequence[LineReport]) -> dict[str, str]:
    """The message of each line, by its topic."""
    return {
        f"{root}/{level(line.name)}/line": json_text(_line(line.text, line.state, line.counters))
        for line in lines
    }


def _line(text: str, state: LineState, counters: LineCounters) -> dict[str, Any]:
    counted = asdict(counters)
    return {
        "schema": JSON_SCHEMA,
        "line": text,
        "state": state.status.value,
        "reason": state.reason or None,
        "counters": {name: counted[name] for name in LINE_COUNTS},
        "last_minute": minute_json(counters.minute, counters.minute.share),
    }


def _drive(line: LineReport, drive: DriveStatus) -> dict[str, Any]:
    if drive.session is None or drive.cycle is None:
        profile = drive.session.profile.id if drive.session is not None else None
        return {
            "schema": JSON_SCHEMA, "time": None, "line": line.text, "device": drive.device,
            "profile": profile, "timeout": None, "values": {}, "state": None, "direction": None,
            "fault": None, "error": drive.error or "No cycle has ended yet.",
            "contact": drive.contact, "cycle": None,
        }  # fmt: skip
    fault = drive.cycle.state.fault
    return {
        "schema": JSON_SCHEMA,
        **cycle_json(line.text, drive.session, drive.cycle),
        "fault": {"code": fault.code, "name": fault.name} if fault is not None else None,
    }
