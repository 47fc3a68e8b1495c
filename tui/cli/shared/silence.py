"""Advice if no drive answers, for commands on one line."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.session.connect.open_line import OpenLine


STATE_COMES_WITHIN = 0.4
"""Seconds in which the keeper of a line has sent the state of a drive."""
ANSWERS_LATE = (
    "It answers, but after its timeout. Add ,timeout=SECONDS to LINE, for example ,timeout=2; the"
    " longest is 30 s."
)


def wait_for_state(line: ModbusLine) -> None:
    """Wait until the keeper of a line has sent its state."""
    if line.facts.voice is not None:
        time.sleep(STATE_COMES_WITHIN)


def is_slow(line: ModbusLine, device: int) -> bool:
    """True if late replies of a drive came that did not answer in time."""
    from tui.bus.link import TcpLink

    # over Modbus TCP late replies are counted for the line alone
    late = isinstance(line.link, TcpLink) and line.counters.stale > 0
    return late or line.device_state(device).lateness > 0


_AS_TYPED = (
    "Are address, wiring, {link.baud} baud and {link.format} (as typed) those of the drive?"
    " Others: serial:{link.path},BAUD,FORMAT."
)
_OF_PROFILE = (
    "Are address, wiring, {link.baud} baud and {link.format} (the profile's own) those of the"
    " drive? Others: serial:{link.path},BAUD,FORMAT."
)
_DEFAULTS = (
    "Are address, wiring, {link.baud} baud and {link.format} (as no others are named) those of the"
    " drive? Others: serial:{link.path},BAUD,FORMAT."
)


def about_silence(opened: OpenLine, text: str, device: int, *, by_profile: bool) -> str:
    """Return what to check if no drive answers; empty for a line without settings of its own."""
    from tui.bus.link import SerialLink, UsualSettings, parse_link

    link = opened.line.link
    if is_slow(opened.line, device):
        return ANSWERS_LATE
    if not isinstance(link, SerialLink) or opened.simulation is not None:
        return ""
    other = UsualSettings(link.baud + 1, "8N1" if link.format != "8N1" else "8E1")
    plain = parse_link(text, other)
    named = isinstance(plain, SerialLink) and (plain.baud, plain.format) == (link.baud, link.format)
    text = _AS_TYPED if named else _OF_PROFILE if by_profile else _DEFAULTS
    return text.format(link=link)


def silence_hint(error: Exception, opened: OpenLine, text: str, *, by_profile: bool) -> str:
    """The same behind an error, with a space; empty for any other error than silence."""
    from tui.bus.errors import NoAnswer

    if not isinstance(error, NoAnswer):
        return ""
    hint = about_silence(opened, text, error.device, by_profile=by_profile)
    return f" {hint}" if hint else ""
