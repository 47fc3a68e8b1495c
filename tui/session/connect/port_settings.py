"""Settings with which each serial port was used last, from the recent lines."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tui.bus.link import SerialLink


class PortSettings(NamedTuple):
    """Settings with which a serial port was used last."""

    baud: int
    format: str
    timeout: float | None = None
    """Longest wait for a reply in seconds, if a person has set it."""


def last_settings(recent: Sequence[str]) -> dict[str, PortSettings]:
    """Return the last settings of each serial port by its real path; the newest line is first."""
    found: dict[str, PortSettings] = {}
    for text in recent:
        if (link := _serial_link(text)) is not None:
            settings = PortSettings(link.baud, link.format, link.timeout)
            found.setdefault(os.path.realpath(link.path), settings)
    return found


def port_of(text: str) -> str:
    """Return the real path of the port of a serial line; empty for another line."""
    link = _serial_link(text)
    return os.path.realpath(link.path) if link is not None else ""


def with_last_settings(text: str, recent: Sequence[str]) -> str:
    """Return a serial line that names no settings with those of its port's last use.

    Any other line is returned unchanged, and one whose port was not used before.
    """
    from tui.bus.link import SerialLink, UsualSettings, label, parse_link

    link = _serial_link(text)
    if link is None or (last := last_settings(recent).get(os.path.realpath(link.path))) is None:
        return text
    other = UsualSettings(link.baud + 1, "8N2" if link.format != "8N2" else "8E1")
    assumed = parse_link(text, other)
    if not isinstance(assumed, SerialLink) or (assumed.baud, assumed.format) != (
        other.baud,
        other.format,
    ):
        return text  # it names its settings, at least some
    return label(SerialLink(link.path, last.baud, last.format, link.timeout or last.timeout))


def _serial_link(text: str) -> SerialLink | None:
    from tui.bus.errors import LinkSyntaxError
    from tui.bus.link import SerialLink, parse_link

    try:
        link = parse_link(text)
    except LinkSyntaxError:
        return None  # a simulated line
    return link if isinstance(link, SerialLink) else None
