"""Another master is detected before anything is sent, and reported with its requests."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

from tests.bus.peer import PtyPeer, Step, eventually, silent
from tui.bus.errors import LineError
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.trace import Frame
from tui.session.connect.other_masters import (
    MasterDetector,
    OtherMaster,
    Overheard,
    listen_first,
    overheard,
)
from tui.wire.frames import frame, read_frame


def came(data: bytes, note: str, time: float = 1.0) -> Frame:
    return Frame(time, "in", data, note)


READ = read_frame(4, 3201, 8)
WRITE = frame(7, bytes.fromhex("06 2135 0006"))
LATE = "late or repeated, device 4"


def test_other_master_is_reported_with_its_requests() -> None:
    heard = overheard([came(READ, LATE), came(WRITE, "of device 7"), came(READ, LATE)], 0.0)
    assert heard.text == (
        "Another master polls drives on this line. Address 4: read of registers 3201 to 3208."
        " Address 7: write of register 8501."
    )


def test_many_requests_to_one_address_are_summarized() -> None:
    frames = [came(read_frame(4, register, 1), LATE) for register in range(5)]
    assert "read of register 2 and 2 more." in overheard(frames, 0.0).text


@pytest.mark.parametrize(
    "frames",
    [
        [came(READ, LATE, time=-1.0)],
        [Frame(0.0, "out", READ), came(READ, LATE)],
        [came(READ, "echo")],
        [came(frame(4, bytes.fromhex("03 02 0006")), "")],
        [came(b"\0\0\0", "noise")],
    ],
    ids=["before", "our own, late", "echo", "a reply to us", "a spark"],
)
def test_own_or_damaged_frames_show_no_master(frames: list[Frame]) -> None:
    assert overheard(frames, 0.0).text == ""


def test_foreign_replies_and_unknown_bytes_show_a_master() -> None:
    reply = frame(4, bytes.fromhex("03 02 0006"))
    assert "address 4 answered it" in overheard([came(reply, LATE)], 0.0).text
    assert "Received 6 bytes that form no frame" in Overheard(loose=6).text


@contextmanager
def talking(peer: PtyPeer, *, gap: float) -> Iterator[None]:
    """A master on the line of a peer, with this many seconds between its frames."""
    over = threading.Event()

    def talk() -> None:
        while not over.wait(gap):
            peer.send(READ)

    thread = threading.Thread(target=talk, name="other master")
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


@pytest.mark.parametrize("gap", [0.1, 0.004], ids=["now and then", "without a silence"])
async def test_master_is_detected_on_an_idle_line(gap: float) -> None:
    with PtyPeer(silent) as peer:
        line = Line(SerialLink(peer.path))
        line.open(wait=10.0)
        try:
            with talking(peer, gap=gap):
                heard = await listen_first(line, 2.0)
            assert {request.device for request in heard.requests} == {4}
            assert peer.requests == []
        finally:
            line.close()


async def test_damaged_replies_to_polls_do_not_show_a_master() -> None:
    def damaged(request: bytes, _count: int) -> Sequence[Step]:
        return [frame(request[0], bytes.fromhex("03 02 0001"))[:-1] + b"\0"]

    with PtyPeer(damaged) as peer:
        line = Line(SerialLink(peer.path))
        line.open(wait=10.0)
        try:
            listening = asyncio.create_task(listen_first(line, 0.5))
            for _ in range(3):
                with pytest.raises(LineError):
                    await line.read(2, 3201, 1)
            assert (await listening).text == ""
            assert len(peer.requests) >= 3
        finally:
            line.close()


async def test_master_that_starts_during_a_scan_ends_it() -> None:
    with PtyPeer(silent) as peer:
        line = Line(SerialLink(peer.path))
        line.open(wait=10.0)
        try:
            lookout = MasterDetector(line)
            lookout.look()
            peer.send(READ)
            await asyncio.to_thread(eventually, lambda: bool(line.trace))
            with pytest.raises(OtherMaster, match="Address 4"):
                lookout.look()
        finally:
            line.close()
