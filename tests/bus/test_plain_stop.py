"""A stop in its plain form: who may send it, which drives it stops, and invalid forms."""

from __future__ import annotations

import asyncio
import os
import random
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.line_events import on_event
from tui.bus.bounds import MOST_STOPPERS
from tui.bus.line import Line
from tui.bus.line_events import DevicesStopped, StopDue
from tui.bus.program import Program
from tui.bus.share.beside import (
    GIVEN,
    LONGEST_PLAIN_STOP,
    STOP_HEAD,
    plain_stop,
    send_plain_stop,
    stop_devices,
)
from tui.bus.share.messages import LONGEST_MESSAGE, NoMessage
from tui.bus.share.place import Peer

from .conftest import Share
from .peer import PtyPeer, eventually, honest
from .sharing import SharedLines
from .test_share_bounds import voided_and_stopped
from .test_share_ends import raw

Stop = tuple[tuple[int, ...], str, Program]
FORMS = {
    b" 2\n": (2,),
    b" 2 3\n": (2, 3),
    b" 3 2 3\n": (3, 2),
    b" 1 247\n": (1, 247),
    b" all\n": (5, 9),
    b" " + b" ".join(str(n).encode() for n in range(1, 248)) + b"\n": tuple(range(1, 248)),
}
NO_FORMS = (
    b"\n", b" \n", b"  2\n", b" 2 \n", b" 2  3\n", b"2\n", b"\t2\n", b" 2,3\n", b" 2\r\n", b" 02\n",
    b" 0\n", b" 248\n", b" 999999\n", b" -1\n", b" +1\n", b" 1.0\n", b" 1_0\n", b" \xd9\xa1\n",
    b" \0\n", b" 2\0\n", b"\0 2\n", b" all 2\n", b" 2 all\n", b" ALL\n", b" all \n", b" \xff\n",
    b" 2 x\n", b" 2\n3\n", b" " + b"9" * 5000 + b"\n", b" 2" * LONGEST_PLAIN_STOP + b"\n",
)  # fmt: skip
MUTATED = 100_000


async def stop_of(data: bytes) -> tuple[int, ...]:
    """Devices that a message of a program stops after the head."""
    reader = asyncio.StreamReader()
    reader.feed_data(data)
    reader.feed_eof()
    return (await plain_stop(reader, (0, 5, 9, 255), Peer(7, 0))).devices


def later_stops(line: Line) -> list[Stop]:
    """Later stops by others that a program gets."""
    heard: list[Stop] = []
    on_event(
        line.facts,
        DevicesStopped,
        lambda event: heard.append((event.devices, event.by, event.program)),
    )
    return heard


def give(lines: SharedLines, form: bytes) -> bytes:
    """Send a stop in its plain form; returns all that is answered."""
    with raw(lines) as connection, suppress(ConnectionError):
        connection.sendall(STOP_HEAD + form)
        return b"".join(iter(lambda: connection.recv(100), b""))
    return b""


def test_plain_stop_head_is_not_a_message_length() -> None:
    assert int.from_bytes(STOP_HEAD, "big") > LONGEST_MESSAGE


@pytest.mark.parametrize(("form", "devices"), FORMS.items(), ids=range(len(FORMS)))
async def test_plain_stop_returns_its_devices(form: bytes, devices: tuple[int, ...]) -> None:
    assert await stop_of(form) == devices


@pytest.mark.parametrize("form", NO_FORMS, ids=range(len(NO_FORMS)))
async def test_plain_stop_malformed_raises(form: bytes) -> None:
    with pytest.raises(NoMessage):
        stop_devices(form, (5, 9))


async def test_plain_stop_without_an_end_raises() -> None:
    with pytest.raises(EOFError):
        await stop_of(b" 2")
    with pytest.raises(NoMessage):
        await stop_of(b" 2" * 100_000)


def mutated_forms() -> Iterator[bytes]:
    """Forms with some of their bytes changed, taken out or doubled; the same each time."""
    chance, forms = random.Random(29), [*list(FORMS)[:-1], *NO_FORMS[:-2]]
    for _ in range(MUTATED):
        data = bytearray(chance.choice(forms))
        for _ in range(chance.randint(1, 3)):
            place = chance.randrange(len(data) + 1)
            new = chance.choice((b"", b" ", b"\n", b"\0", b"all", b"247", chance.randbytes(2)))
            data[place : place + chance.randint(0, 2)] = new
        yield bytes(data)


async def test_plain_stop_mutated_returns_its_devices_or_raises() -> None:
    taken = refused = 0
    for data in mutated_forms():
        try:
            devices = await stop_of(data)
        except (NoMessage, EOFError):
            refused += 1
            continue
        taken += 1
        line = data.partition(b"\n")[0]
        named = b"5 9" if line == b" all" else line.removeprefix(b" ")
        assert devices == tuple(dict.fromkeys(map(int, named.split(b" "))))
        assert all(1 <= device <= 247 for device in devices)
    assert taken > 1000
    assert refused > 1000


UNATTACHED = 4711
"""A process that shares no line."""


async def test_plain_stop_reaches_every_program_as_from_an_unattached_one(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    # all programs of a test are in one process, so a stop from it would have their name
    sender = Peer(UNATTACHED, os.getuid())
    monkeypatch.setattr("tui.bus.share.greeting.peer_of", lambda _: sender)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        before = {line: line.facts.stops.stamp(3) for line in (owner, other)}
        heard = [later_stops(owner), later_stops(other)]
        due: list[tuple[tuple[int, ...], str]] = []
        on_event(owner.facts, StopDue, lambda event: due.append((event.devices, event.by)))
        assert await asyncio.to_thread(give, lines, b" 3 4\n") == GIVEN
        eventually(lambda: all(heard))
        for ((devices, by, program),) in heard:
            assert (devices, by) == ((3, 4), "drivepanel stop")
            assert program.text == f"stop (pid {UNATTACHED})"
            assert program not in owner.facts.programs
        # no program carries it out, so the owner does
        assert due == [((3, 4), f"stop (pid {UNATTACHED})")]
        for line in (owner, other):
            # pending writes of every program are cancelled
            assert "a stop came after it" in line.facts.refusal(line.facts.me.id, 3, before[line])
            assert not line.facts.refusal(line.facts.me.id, 5, line.facts.stops.stamp(5))
        await voided_and_stopped(lines, peer, other, owner)


async def test_plain_stop_of_all_stops_the_known_devices(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        heard = later_stops(owner)
        assert await asyncio.to_thread(give, lines, b" all\n") == GIVEN
        ((devices, _, _),) = heard
        assert devices == tuple(range(1, 10))


async def test_plain_stops_each_count_and_keep_few_names(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        before = owner.facts.stops.stamp(3)
        for _ in range(MOST_STOPPERS + 10):
            assert await asyncio.to_thread(give, lines, b" 3\n") == GIVEN
        assert owner.facts.stops.stamp(3) == before + MOST_STOPPERS + 10
        assert len(owner.facts.stops.given[3]) < 5
        eventually(lambda: other.facts.stops.stamp(3) == owner.facts.stops.stamp(3))
        await voided_and_stopped(lines, peer, other, owner)
        await voided_and_stopped(lines, peer, owner, other)


async def test_plain_stop_malformed_ends_its_connection_only(
    share: Share, caplog: pytest.LogCaptureFixture
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        heard = later_stops(owner)
        for form in NO_FORMS:
            if form != b" 2\n3\n":
                assert await asyncio.to_thread(give, lines, form) == b""
        assert not heard
        assert [program.name for program in owner.facts.others] == ["watch"]
        await voided_and_stopped(lines, peer, other, owner)
    assert "serving a program on the line failed" not in caplog.text


async def test_plain_stop_of_another_user_is_refused(
    share: Share, monkeypatch: pytest.MonkeyPatch
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        heard = later_stops(owner)
        foreign = Peer(4711, os.getuid() + 4711)
        monkeypatch.setattr("tui.bus.share.greeting.peer_of", lambda _: foreign)
        assert await asyncio.to_thread(give, lines, b" 3\n") == b""
        assert not heard
        # root may
        monkeypatch.setattr("tui.bus.share.greeting.peer_of", lambda _: Peer(4711, 0))
        assert await asyncio.to_thread(give, lines, b" 3\n") == GIVEN
        assert len(heard) == 1


async def test_client_stops_by_a_separate_connection(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, client = lines.open("panel"), lines.open("run")
        await client.read(1, 100)
        due: list[tuple[int, ...]] = []
        on_event(owner.facts, StopDue, lambda event: due.append(event.devices))
        heard = later_stops(client)
        assert client.facts.voice is not None
        await asyncio.to_thread(client.facts.voice.stop_directly, (1, 3))
        eventually(lambda: due == [(1, 3)])
        eventually(lambda: len(heard) == 1)
        ((devices, by, program),) = heard
        assert (devices, by) == ((1, 3), "a direct stop")
        # by the name of the first program of this process, under an id of its own
        assert program.text == owner.facts.me.text
        assert program.id not in (owner.facts.me.id, client.facts.me.id)


async def test_holder_sends_no_direct_stop(share: Share) -> None:
    with PtyPeer(honest) as peer:
        owner = share(peer.path).open("panel")
        await owner.read(1, 100)
        assert owner.facts.voice is not None
        owner.facts.voice.stop_directly((1,))
        assert owner.facts.stops.plain == {}


async def test_plain_stop_without_an_acknowledgment_raises(tmp_path: Path) -> None:
    """The connection ends without the answer: the keeper has died, or does not know the program."""

    async def turns_away(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readline()
        writer.close()

    address = tmp_path / "socket"
    async with await asyncio.start_unix_server(turns_away, str(address)):
        with pytest.raises(OSError, match=r"accept the stop|reset|Broken pipe"):
            await asyncio.to_thread(send_plain_stop, address, (1,))
