"""Conclusions on the sender's speed from bytes that form no frame; pure functions."""

from __future__ import annotations

from math import log

from tui.bus.link import SerialLink

from .evidence import DiagnosticEvidence

USUAL_BAUDS = (1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
USUAL_FORMATS = ("8E1", "8N1", "8N2", "8O1")
SAME_SPEED = 1.3
"""Greatest ratio of received to due bytes that still indicates the same speed."""


_SAME_SPEED = "the speed is right, but the format is probably wrong"
_SLOWER = "the drive sends more slowly"
_SLOWER_AT = "the drive sends more slowly, probably at {baud} bit/s"
_FASTER = "the drive sends faster"
_FASTER_AT = "the drive sends faster, probably at {baud} bit/s"


def speed_text(sight: DiagnosticEvidence) -> str:
    """Return the conclusion from the number of bytes: a receiver at half the speed sees half of
    them."""
    came, due = sight.heard.compared
    if not came or not due:
        return ""
    likely = likely_baud(sight)
    if same_speed(sight):
        text = _SAME_SPEED
    elif came > due:
        text = _SLOWER_AT if likely else _SLOWER
    else:
        text = _FASTER_AT if likely else _FASTER
    return f"{came} bytes arrived instead of {due}, so {text.format(baud=likely)}"


def same_speed(sight: DiagnosticEvidence) -> bool:
    """Return True if the number of received bytes is about the number due."""
    came, due = sight.heard.compared
    return bool(came and due) and 1 / SAME_SPEED < came / due < SAME_SPEED


def other_formats(sight: DiagnosticEvidence) -> tuple[str, ...]:
    """Return the family's formats other than the line's; none for a device server."""
    if not isinstance(sight.link, SerialLink):
        return ()
    known = sight.profile.data.link.formats if sight.profile is not None else ()
    return tuple(format_ for format_ in known or USUAL_FORMATS if format_ != sight.link.format)


def likely_baud(sight: DiagnosticEvidence) -> int | None:
    """Return the other baud of the family that fits the bytes best.

    None if the present one fits, and for a device server.
    """
    came, due = sight.heard.compared
    if not came or not due or same_speed(sight) or not isinstance(sight.link, SerialLink):
        return None
    known = sight.profile.data.link.bauds if sight.profile is not None else ()
    wanted = sight.link.baud * due / came
    others = [baud for baud in known or USUAL_BAUDS if baud != sight.link.baud]
    return min(others, key=lambda baud: abs(log(baud / wanted)), default=None)
