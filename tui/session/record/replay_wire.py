"""The wire of a replay: a link that leads nowhere, and the frames of the record."""

from __future__ import annotations

from dataclasses import replace

from tui.bus.bounds import MOST_BYTES
from tui.bus.errors import LinkSyntaxError
from tui.bus.link import Link, SerialLink, TcpLink, parse_link
from tui.bus.trace import Frame
from tui.wire.frames import frame

from .rebuilt_frames import RebuiltFrame

NO_HOST = "replay.invalid"
"""A name that no host can have: the line of a replay must never be reached."""


def replayed_link(line: str) -> Link:
    """Return the recorded link, to plan reads as then; it leads to no port and no host."""
    try:
        link = parse_link(line)
    except LinkSyntaxError:
        return SerialLink("replay")
    if isinstance(link, SerialLink):
        return replace(link, path="replay")
    if isinstance(link, TcpLink):
        return replace(link, host=NO_HOST)
    return replace(link, host=NO_HOST)


def wire_frame(rebuilt: RebuiltFrame, link: Link) -> Frame:
    """Return a frame as the line of a link has it, with checksum or head."""
    data = rebuilt.data
    if rebuilt.checked and isinstance(link, TcpLink):
        data = bytes(4) + (len(data) + 1).to_bytes(2, "big") + bytes([rebuilt.device]) + data
    elif rebuilt.checked:
        data = frame(rebuilt.device, data)
    note = "" if rebuilt.checked else "damaged"
    return Frame(rebuilt.wall, "out" if rebuilt.request else "in", data[:MOST_BYTES], note)
