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


LATE_ON_LINE = (
    "A late reply came on this line; it may be of this drive. If so, add ,timeout=SECONDS to LINE,"
    " for example ,timeout=2; the longest is 30 s."
)


def has_late_replies(line: ModbusLine) -> bool:
    """True if late replies came over Modbus TCP, where they are counted for the line alone."""
    from tui.bus.link import TcpLink

    return isinstance(line.link, TcpLink) and line.counters.stale > 0


_SETTINGS = "Are address, wiring, {settings} those of the drive? Others: serial:{path},BAUD,FORMAT."


def about_silence(opened: OpenLine, text: str, device: int, *, by_profile: bool) -> str:
    """Return what to check if no drive answers; empty for a line without settings of its own."""
    from tui.bus.link import SerialLink, UsualSettings, parse_link

    link = opened.line.link
    if opened.line.device_state(device).lateness > 0:
        return ANSWERS_LATE
    if has_late_replies(opened.line):
        return LATE_ON_LINE
    if not isinstance(link, SerialLink) or opened.simulation is not None:
        return ""
    other = UsualSettings(link.baud + 1, "8N1" if link.format != "8N1" else "8E1")
    plain = parse_link(text, other)
    usual = "the profile's own" if by_profile else "the default"
    typed = (plain.baud, plain.format) if isinstance(plain, SerialLink) else (0, "")
    baud = "as typed" if typed[0] == link.baud else usual
    format_ = "as typed" if typed[1] == link.format else usual
    settings = f"{link.baud} baud ({baud}) and {link.format} ({format_})"
    if baud == format_:
        settings = f"{link.baud} baud and {link.format} ({baud})"
    return _SETTINGS.format(settings=settings, path=link.path)


def silence_hint(error: Exception, opened: OpenLine, text: str, *, by_profile: bool) -> str:
    """The same behind an error, with a space; empty for any other error than silence."""
    from tui.bus.errors import NoAnswer

    if not isinstance(error, NoAnswer):
        return ""
    hint = about_silence(opened, text, error.device, by_profile=by_profile)
    return f" {hint}" if hint else ""
