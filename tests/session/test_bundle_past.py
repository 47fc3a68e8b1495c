"""The last minutes of a line that this program has not open: its frames and messages."""

from __future__ import annotations

import asyncio
import os

import pytest

from tests.bus.peer import PtyPeer, honest
from tui.bus.api import Frame
from tui.bus.fake import FakeLine
from tui.bus.link import parse_link
from tui.session.bundle.drive_parts import past_parts
from tui.session.bundle.parts import PartResult, collect_parts
from tui.session.bundle.subject import BundleSubject, DriveDocuments
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.event_notes import EventNotes
from tui.session.events import EventLog
from tui.wire.frames import sealed

pytestmark = pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")


def subject_of(text: str) -> BundleSubject:
    async def nothing(_: int) -> None:
        raise AssertionError

    return BundleSubject(
        text=text,
        link=parse_link(text),
        opened=None,
        trouble=None,
        devices=(1,),
        open_drive=nothing,  # type: ignore[arg-type]
        documents=DriveDocuments(dict, dict, dict),  # type: ignore[arg-type]
        expected_profile=lambda _: None,
    )


async def collected(text: str) -> dict[str, PartResult]:
    return {part.part.name: part for part in await collect_parts([*past_parts(subject_of(text))])}


async def test_past_of_a_line_of_another_program_is_collected() -> None:
    with PtyPeer(honest) as peer:
        opened = await asyncio.to_thread(open_line, peer.path, wait=5.0, program="panel")
        try:
            events = EventLog()
            notes = EventNotes(opened.line.facts, events)
            events.add("alarm", "Drive 1 is late.", 1)
            await opened.line.read(1, 7)
            found = await collected(peer.path)
        finally:
            await asyncio.to_thread(opened.close)
            del notes
    frames, messages = found["frames.pcapng"].file, found["messages.txt"].file
    assert frames is not None
    assert frames.note.startswith("2 frames, from ")
    assert messages is not None
    assert "alarm    drive 1: Drive 1 is late.\n" in str(messages.content)
    assert found["screens"].missing.startswith("Screens are in a bundle only")


async def test_bundle_does_not_displace_earlier_frames() -> None:
    line = FakeLine({1: {}}, link=parse_link("/dev/nosuch"))
    frames = [Frame(float(number), "out", sealed(bytes([1, 3, 0, number]))) for number in range(6)]
    line.trace = tuple(frames[:4])
    subject = subject_of("/dev/nosuch")
    subject.opened = OpenLine("/dev/nosuch", line)
    parts = [*past_parts(subject)]
    line.trace = tuple(frames[2:])
    found = {part.part.name: part for part in await collect_parts(parts)}
    file = found["frames.raw.pcapng"].file
    assert file is not None
    assert file.note.startswith("6 frames")


async def test_line_without_a_holder_has_no_past() -> None:
    found = await collected("tcp:127.0.0.1:9")
    assert "No process holds the line" in found["frames.pcapng"].missing
    assert "No process holds the line" in found["messages.txt"].missing
