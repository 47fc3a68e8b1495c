"""Several programs on one line: requests are sent in one order, one exchange at a time."""

from __future__ import annotations

import asyncio
import os
import stat
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from tests.line_events import on_event
from tui.bus.api import LineStatus, Priority
from tui.bus.errors import DeviceException, LineBusy, NoAnswer, RequestRefused
from tui.bus.line_events import ControlAnswered, ControlDenied, ControlRequested, DeviceWritten
from tui.bus.share.place import SharePlace
from tui.wire.frames import frame

from .conftest import Share
from .peer import PtyPeer, Step, eventually, honest, reply, silent
from .sharing import QUICK, frozen, place_in

UNANSWERED = 98


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.1, reply(request)]


def note_denied(denied: list[str], name: str, _event: ControlDenied) -> None:
    denied.append(name)


def kinds(peer: PtyPeer) -> list[tuple[int, int]]:
    """Function and register of every request on the wire."""
    return [(request[1], int.from_bytes(request[2:4], "big")) for request in peer.requests]


async def test_attached_program_can_send_every_request(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("backup")
        assert (await owner.read(1, 100, 2)).words == (100, 101)
        assert (await other.read(2, 200, 3)).words == (200, 201, 202)
        await other.write(1, 50, [7])
        assert (await other.read_write(1, 60, 1, 61, [9])).words == (60,)
        assert (await other.identify(1)).objects
        assert kinds(peer)[2:4] == [(6, 50), (23, 60)]
        assert "Shared with panel" in other.state.reason
        assert [program.name for program in owner.facts.others] == ["backup"]
        assert other.state.status is LineStatus.CONNECTED


async def test_write_is_reported_to_all_programs_before_a_later_reply(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        programs = [lines.open(name) for name in ("panel", "run", "watch")]
        owner, run, watch = programs
        reported: list[list[DeviceWritten]] = [[], [], []]
        for program, found in zip(programs, reported, strict=True):
            await program.read(1, 1)
            on_event(program.facts, DeviceWritten, found.append)
        await run.write(1, 50, [7])
        await asyncio.gather(*(program.read(1, 50) for program in (owner, watch)))
        assert [[(w.device, w.words) for w in found] for found in reported] == [[(1, {50: 7})]] * 3
        await owner.write(2, 60, [8, 9])
        await run.read_write(1, 60, 1, 61, [9])
        await watch.read(1, 50)
        assert [write.program.name for write in reported[2]] == ["run", "panel", "run"]
        assert [write.words for write in reported[2]] == [{50: 7}, {60: 8, 61: 9}, {61: 9}]


async def test_refused_write_is_not_reported(share: Share) -> None:
    def refuses(request: bytes, _count: int) -> Sequence[Step]:
        return [frame(request[0], bytes([request[1] | 0x80, 2]))]

    with PtyPeer(refuses) as peer:
        lines = share(peer.path)
        reported: list[DeviceWritten] = []
        on_event(lines.open("panel").facts, DeviceWritten, reported.append)
        with pytest.raises(DeviceException):
            await lines.open("run").write(3, 700, [1])
        assert reported == []


async def test_exception_of_a_drive_reaches_the_sender(share: Share) -> None:
    def refuses(request: bytes, _count: int) -> Sequence[Step]:
        return [frame(request[0], bytes([request[1] | 0x80, 2]))]

    with PtyPeer(refuses) as peer:
        lines = share(peer.path)
        lines.open("panel")
        with pytest.raises(DeviceException) as caught:
            await lines.open("backup").read(3, 700)
        assert (caught.value.device, caught.value.code, caught.value.address) == (3, 2, 700)


async def test_priorities_hold_across_programs_with_one_exchange_in_flight(
    share: Share,
) -> None:
    with PtyPeer(slow) as peer:
        lines = share(peer.path)
        programs = [lines.open(name) for name in ("panel", "watch", "backup")]
        owner, watch, backup = programs
        first = asyncio.create_task(owner.read(1, 1))
        await asyncio.to_thread(peer.await_requests, 1)
        waiting: list[asyncio.Task[object]] = [
            asyncio.create_task(line.read(1, 10 + number))
            for number, line in enumerate(programs * 2)
        ]
        waiting.append(asyncio.create_task(backup.write(1, 30, [1])))
        await asyncio.sleep(0.02)
        stop = asyncio.create_task(watch.write(1, 40, [0], priority=Priority.STOP))
        await asyncio.gather(first, *waiting, stop)
        order = kinds(peer)
        assert order[:3] == [(3, 1), (6, 40), (6, 30)]
        # a request that follows the previous one without a gap would be read together with it
        assert [len(burst) for burst in peer.bursts] == [8] * len(order)


async def test_program_with_too_many_requests_does_not_block_others(
    share: Share,
) -> None:
    with PtyPeer(slow) as peer:
        lines = share(peer.path)
        few = replace(QUICK, queue_length=8)
        owner, other = lines.open("panel", timing=few), lines.open("scan", timing=few)
        reading = asyncio.create_task(owner.read(1, 1))
        await asyncio.to_thread(peer.await_requests, 1)
        many = [asyncio.create_task(other.read(1, 20 + number)) for number in range(6)]
        await asyncio.sleep(0.05)
        assert (await owner.read(1, 2)).words == (2,)
        await reading
        results = await asyncio.gather(*many, return_exceptions=True)
        assert sum(isinstance(result, LineBusy) for result in results) == 2


async def test_abandoned_request_is_not_sent(share: Share) -> None:
    with PtyPeer(slow) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("backup")
        first = asyncio.create_task(owner.read(1, 1))
        await asyncio.to_thread(peer.await_requests, 1)
        unwanted = asyncio.create_task(other.read(1, 66))
        await asyncio.sleep(0.03)
        unwanted.cancel()
        await first
        await other.read(1, 67)
        assert (3, 66) not in kinds(peer)


async def test_client_gets_counters_devices_frames_and_line_state(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        assert other.trace == ()
        await owner.read(1, 100)
        eventually(lambda: other.device_state(1).answers is True)
        eventually(lambda: other.counters.replies == owner.counters.replies)
        await owner.read(1, 101)
        eventually(lambda: any(frame.data[1:4] == b"\x03\x00\x65" for frame in other.trace))


async def test_clients_report_a_lost_line_and_recover_with_it(share: Share, tmp_path: Path) -> None:
    link = tmp_path / "port"
    with PtyPeer(honest, link=link) as peer:
        lines = share(str(link))
        lines.open("panel")
        other = lines.open("watch")
        peer.unplug()
        eventually(lambda: other.state.status is LineStatus.LOST)
        assert other.state.reason
    with PtyPeer(honest, link=link):
        eventually(lambda: other.state.status is LineStatus.CONNECTED)
        assert (await other.read(1, 5)).words == (5,)


async def test_value_is_reused_if_a_program_accepts_its_age(
    share: Share,
) -> None:
    values = iter(range(100, 200))

    def counting(request: bytes, _count: int) -> Sequence[Step]:
        if request[3] == UNANSWERED:
            return []
        words = b"".join(next(values).to_bytes(2, "big") for _ in range(request[5]))
        return [
            frame(request[0], bytes([3, len(words)]) + words) if request[1] == 3 else reply(request)
        ]

    with PtyPeer(counting) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("panel2")
        read = await owner.read(1, 10, 4)
        shared = await other.read(1, 11, 2, max_age=60)
        assert (shared.words, shared.time) == ((101, 102), read.time)
        assert len(peer.requests) == 1
        # no age accepted, too old, another device, another register: each on the wire
        for work in (
            other.read(1, 11, 2),
            other.read(1, 11, 2, max_age=1e-9),
            other.read(2, 11, 2, max_age=60),
            other.read(1, 14, 1, max_age=60),
        ):
            await work
        assert len(peer.requests) == 5
        # words of two replies are never one answer: they may be of two moments
        await other.read(1, 10, 4, max_age=60)
        assert len(peer.requests) == 6
        # a write of any program makes them old
        await owner.write(1, 99, [1])
        await other.read(1, 11, 2, max_age=60)
        assert len(peer.requests) == 8
        # also an unanswered one
        with pytest.raises(NoAnswer):
            await other.write(1, UNANSWERED, [1])
        await owner.read(1, 11, 2, max_age=60, priority=Priority.OPERATOR_READ)
        assert len(peer.requests) == 10


async def test_single_program_reuses_no_value(share: Share) -> None:
    with PtyPeer(honest) as peer:
        line = share(peer.path).open("panel")
        await line.read(1, 10)
        await line.read(1, 10, max_age=60)
        assert len(peer.requests) == 2


# Who commands


async def test_drive_commanded_by_another_program_is_not_written(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other, third = (lines.open(name) for name in ("panel", "run", "restore"))
        await owner.read(1, 1)
        assert other.facts.claim(1) == ""
        eventually(lambda: third.facts.commander(1) is not None)
        assert "commanded by run" in third.facts.claim(1)
        for line in (owner, third):
            with pytest.raises(RequestRefused, match="Drive 1 is commanded by run"):
                await line.write(1, 8, [1])
        # not even if the writer does not know of it yet: the owner refuses
        third.facts.note_commander(1, None)
        with pytest.raises(RequestRefused, match="Drive 1 is commanded by run"):
            await third.write(1, 8, [1])
        await other.write(1, 8, [2])
        await third.write(2, 8, [3])
        await third.write(1, 8, [0], priority=Priority.STOP)
        other.facts.release(1)
        eventually(lambda: owner.facts.commander(1) is None)
        eventually(lambda: third.facts.claim(1) == "")
        eventually(lambda: owner.facts.commander(1) is not None)
        await third.write(1, 8, [4])
        assert [request[5] for request in peer.requests if request[1] == 6] == [2, 3, 0, 4]


async def test_one_of_two_simultaneous_claims_is_denied(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        await lines.open("panel").read(1, 1)
        programs = [lines.open(name) for name in ("one", "two")]
        denied: list[str] = []
        for line in programs:
            on_event(line.facts, ControlDenied, partial(note_denied, denied, line.facts.me.name))
        # neither knows of the other's claim before its own is sent
        with frozen(programs[0]), frozen(programs[1]):
            assert [line.facts.claim(4) for line in programs] == ["", ""]
        eventually(lambda: len(denied) == 1)
        winner = next(line for line in programs if line.facts.me.name not in denied)
        loser = next(line for line in programs if line is not winner)
        eventually(lambda: loser.facts.commander(4) == winner.facts.me)
        await winner.write(4, 8, [1])
        with pytest.raises(RequestRefused, match="is commanded by"):
            await loser.write(4, 8, [1])


async def test_program_that_exited_commands_no_drive(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("run")
        other.facts.claim(1)
        eventually(lambda: owner.facts.commander(1) is not None)
        other.close()
        eventually(lambda: owner.facts.commander(1) is None)
        assert owner.facts.claim(1) == ""


async def test_request_reaches_the_commander_and_consent_frees_the_drive(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel")
        holder, asker = lines.open("run"), lines.open("remote")
        answers: list[tuple[int, bool, str]] = []
        on_event(
            asker.facts,
            ControlAnswered,
            lambda event: answers.append((event.device, event.granted, event.why)),
        )
        questions: list[str] = []
        on_event(holder.facts, ControlRequested, lambda event: questions.append(event.program.id))
        holder.facts.claim(1)
        eventually(lambda: asker.facts.commander(1) is not None)
        asker.facts.ask_for(1)
        eventually(lambda: questions == ["remote"])
        holder.facts.answer(1, "remote", yes=False, why="It runs.")
        eventually(lambda: answers == [(1, False, "It runs.")])
        assert asker.facts.commander(1) is not None
        holder.facts.answer(1, "remote", yes=True)
        eventually(lambda: answers[1:] == [(1, True, "")])
        assert asker.facts.claim(1) == ""


# Where programs meet


async def test_socket_and_lock_are_private_and_removed_with_the_program(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(honest) as peer:
        (tmp_path / "run").mkdir(mode=0o755)
        lines = share(peer.path)
        lines.open("panel")
        lines.open("watch")
        found = {
            path.suffix or path.name: stat.S_IMODE(path.stat().st_mode)
            for folder in (tmp_path / "run", tmp_path / "lines")
            for path in (folder, *folder.iterdir())
        }
        assert found == {"run": 0o700, "lines": 0o700, ".sock": 0o600, ".lock": 0o600}
        lines.close()
        assert lines.left_behind == []


async def test_socket_is_recreated_if_its_folder_is_removed(share: Share, tmp_path: Path) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel")
        (sock,) = (tmp_path / "run").iterdir()
        sock.unlink()
        (tmp_path / "run").rmdir()
        eventually(sock.exists)
        assert (await lines.open("late").read(1, 4)).words == (4,)


async def test_removed_lock_is_recreated_so_that_no_other_program_owns(
    share: Share, tmp_path: Path
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("panel")
        (lock,) = (tmp_path / "lines").glob("*.lock")
        lock.unlink()
        eventually(lock.exists)
        late = lines.open("late")
        assert late.facts.programs[0] == owner.facts.me


@pytest.mark.parametrize(
    "held",
    [b"", b"\0\xff" * 50, b'{"version":1}', b"[" * 4000, b"9" * 100_000],
    ids=["empty", "garbage", "half", "deep", "huge"],
)
async def test_damaged_lock_file_blocks_no_program(
    share: Share, tmp_path: Path, held: bytes
) -> None:
    place = place_in(tmp_path)
    place.lock_folder.mkdir()
    place.lock_path.write_bytes(held)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel")
        assert (await lines.open("watch").read(1, 4)).words == (4,)


@pytest.mark.parametrize("trouble", ["a file", "not to be written"])
async def test_next_folder_is_used_if_the_first_cannot_hold_a_socket(
    share: Share, tmp_path: Path, trouble: str
) -> None:
    first = tmp_path / "first"
    if trouble == "a file":
        first.write_text("")
    elif trouble == "not to be written":
        if os.geteuid() == 0:
            first = Path("/proc/self/fdinfo")
        else:
            first.mkdir(mode=0o500)
    place = SharePlace("serial:line", tmp_path / "lines", (first, tmp_path / "run"))
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel", place=place)
        assert (await lines.open("watch", place=place).read(1, 4)).words == (4,)
        assert [path.suffix for path in (tmp_path / "run").iterdir()] == [".sock"]


async def test_socket_with_a_too_long_path_works(share: Share, tmp_path: Path) -> None:
    folder = tmp_path / ("long" * 30)
    place = SharePlace("serial:line", tmp_path / "lines", (folder,))
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel", place=place)
        assert (await lines.open("watch", place=place).read(1, 4)).words == (4,)
        assert [path.suffix for path in folder.iterdir()] == [".sock"]


async def test_line_works_unshared_without_socket_folder(share: Share, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    place = SharePlace("serial:line", tmp_path / "lines", (tmp_path / "file",))
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        line = lines.open("panel", place=place)
        assert (await line.read(1, 4)).words == (4,)
        line.facts.give_stop([1], "here")
        await line.write(1, 8, [1])


async def test_wait_for_an_unknown_device_is_sent_to_the_owner(share: Share) -> None:
    patient = replace(QUICK, first_timeout=600.0, scan_timeout=600.0, retries=0)
    with PtyPeer(silent) as peer:
        lines = share(peer.path)
        lines.open("panel", timing=patient)
        other = lines.open("scan", timing=patient)
        with pytest.raises(NoAnswer):
            await other.read(9, 100, priority=Priority.BACKGROUND, within=0.01)
