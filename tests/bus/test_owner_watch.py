"""Detection of a hung keeper by a program on its line, and its end."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from tests.limits import HEARD_WITHIN, SILENT_OWNER, STOP_HEARD_WITHIN, TAKEN_IN_WITHIN
from tui.bus.errors import OWNER_SILENT
from tui.bus.model import Priority
from tui.bus.program import KEEPER, Program
from tui.bus.share.messages import VERSION, Alive, Asking, Notified, StopGiven
from tui.bus.share.owner_watch import (
    BY_HAND,
    DIES_WITHIN,
    OTHER_CONTAINER,
    OTHER_USER,
    STAYS,
    WATCH_INTERVAL,
    KeeperProcess,
    OwnerWatch,
    is_stop,
)
from tui.bus.share.place import Owner, Peer
from tui.safety import AWAKE

LISTENS = """
import socket, sys
with socket.socket(socket.AF_UNIX) as listening:
    listening.bind(sys.argv[1])
    listening.listen()
    print("ready", flush=True)
    sys.stdin.read()
"""


class MadeUpProcess:
    """A process that a program may end, or may not."""

    remedy = "End it."

    def __init__(self, *, may: bool = True) -> None:
        self.may = may
        self.kills: list[float] = []

    def kill(self) -> bool:
        self.kills.append(time.monotonic())
        return self.may


class Bench:
    """A program on a line that checks the keeper of the line as time passes."""

    def __init__(self, now: float = 100.0) -> None:
        self.now = now
        self.process = MadeUpProcess()
        owner = Owner(VERSION, Program("k", KEEPER, 1), "socket")
        self.watch = OwnerWatch(lambda: self.now, owner)
        self.watch._process = self.process  # type: ignore[assignment]

    def wait(self, seconds: float, *, awake: bool = True, attached: bool = True) -> None:
        """Look all the time, or once at the end."""
        end = self.now + seconds
        while awake and self.now + WATCH_INTERVAL < end:
            self.now += WATCH_INTERVAL
            self.watch.look(attached=attached)
        self.now = end
        self.watch.look(attached=attached)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_keeper_that_does_not_acknowledge_a_stop_is_killed_after_1_s(bench: Bench) -> None:
    bench.wait(1.0)
    bench.watch.note_stop()
    bench.wait(STOP_HEARD_WITHIN - 0.01)
    assert not bench.process.kills
    bench.wait(0.02)
    assert len(bench.process.kills) == 1


def test_notices_do_not_acknowledge_a_stop(bench: Bench) -> None:
    bench.watch.note_stop()
    bench.watch.note_stop()
    for message in (Notified(1, "a"), Alive(), Notified(1, "b")):
        bench.wait(STOP_HEARD_WITHIN / 4)
        bench.watch.hear(message)
    bench.wait(STOP_HEARD_WITHIN / 4)
    assert not bench.process.kills
    bench.wait(STOP_HEARD_WITHIN / 4)
    assert bench.process.kills


def test_keeper_that_acknowledges_stops_is_not_killed(bench: Bench) -> None:
    for _ in range(20):
        bench.watch.note_stop()
        bench.wait(0.5)
        bench.watch.hear(Alive())
    assert not bench.process.kills


@pytest.mark.parametrize("attached", [True, False])
def test_silent_keeper_is_killed_after_3_s(bench: Bench, attached: bool) -> None:
    bench.wait(SILENT_OWNER - 0.01, attached=attached)
    assert not bench.watch.frozen
    bench.wait(HEARD_WITHIN - SILENT_OWNER, attached=attached)
    assert bench.watch.frozen
    assert not bench.process.kills
    bench.wait(0.02, attached=attached)
    assert len(bench.process.kills) == 1
    assert bench.watch.remedy == ""


def test_keeper_that_ignores_the_greeting_of_a_stop_is_killed_after_2_s(
    bench: Bench,
) -> None:
    """It may be at work for a second to make way; stops are acknowledged after that only."""
    bench.watch.note_stop()
    bench.wait(TAKEN_IN_WITHIN + STOP_HEARD_WITHIN - 0.01, attached=False)
    assert not bench.process.kills
    bench.wait(0.02, attached=False)
    assert len(bench.process.kills) == 1


def test_program_that_was_suspended_kills_no_keeper(bench: Bench) -> None:
    """Messages of the keeper are waiting to be read."""
    bench.watch.note_stop()
    bench.wait(60.0, awake=False)
    bench.wait(STOP_HEARD_WITHIN - 0.1)
    assert not bench.process.kills


def test_keeper_that_survives_the_kill_is_reported(bench: Bench) -> None:
    bench.wait(HEARD_WITHIN + 0.1)
    assert len(bench.process.kills) == 1
    bench.wait(DIES_WITHIN - 0.2)
    assert bench.watch.remedy == ""
    bench.wait(0.5)
    assert bench.watch.remedy == "End it."
    assert len(bench.process.kills) == 1
    bench.watch.hear(Alive())
    assert (bench.watch.frozen, bench.watch.remedy) == (False, "")


def test_keeper_that_cannot_be_killed_is_reported_immediately(bench: Bench) -> None:
    bench.process.may = False
    bench.watch.note_stop()
    bench.wait(STOP_HEARD_WITHIN + 0.1)
    assert bench.watch.remedy == "End it."
    assert bench.watch.frozen
    bench.wait(HEARD_WITHIN)
    assert len(bench.process.kills) == 1


def looks_until_frozen(bench: Bench) -> int:
    """Count the looks at a keeper that has long been silent."""
    looks = 0
    while not bench.watch.frozen:
        bench.watch.look(attached=True)
        looks += 1
    return looks


@pytest.mark.internal_errors
def test_program_without_time_to_look_takes_no_keeper_for_frozen(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    """Its messages may be waiting: ten looks more are needed, each time."""
    for _ in range(2):
        bench.now += 60.0
        assert looks_until_frozen(bench) == round(SILENT_OWNER / WATCH_INTERVAL) + 1
        bench.watch.hear(Alive())
        assert not bench.watch.frozen
    assert caplog.messages == [f"{bench.watch._owner.program.text} {OWNER_SILENT}"] * 2


@pytest.mark.internal_errors
def test_keeper_may_be_silent_for_exactly_its_time() -> None:
    """The clock begins at 0, so that each time is exact."""
    bench = Bench(0.0)
    while bench.now < SILENT_OWNER:
        bench.now += 0.125
        for _ in range(4):
            bench.watch.look(attached=True)
    assert not bench.watch.frozen
    while bench.now < HEARD_WITHIN:
        bench.now += 0.125
        bench.watch.look(attached=True)
    assert bench.watch.frozen
    assert not bench.process.kills
    bench.now += 0.125
    bench.watch.look(attached=True)
    assert len(bench.process.kills) == 1
    for remedy in (*[False] * 8, True):  # for a second it may be ending
        bench.now += 0.125
        bench.watch.look(attached=True)
        assert bool(bench.watch.remedy) is remedy


@pytest.mark.internal_errors
def test_stop_may_be_without_an_answer_for_exactly_its_time() -> None:
    bench = Bench(0.0)
    bench.watch.note_stop()
    for kills, now in ((0, 0.25), (0, 0.5), (0, 0.75), (0, STOP_HEARD_WITHIN), (1, 1.125)):
        bench.now = now
        bench.watch.look(attached=True)
        assert len(bench.process.kills) == kills


def test_longest_pause_between_two_looks_is_no_suspension() -> None:
    bench = Bench(0.0)
    bench.now = AWAKE
    bench.watch.look(attached=True)
    assert bench.watch._awake == 0.0
    bench.now = 2.5 * AWAKE
    bench.watch.look(attached=True)
    assert bench.watch._awake == bench.now


def test_is_stop_is_true_for_stop_messages_only() -> None:
    def asking(priority: Priority) -> Asking:
        return Asking(1, "WriteOne", {}, priority, False, 0.0, 0, 0.0)

    assert is_stop(StopGiven((1,), (1,), "a key", Program("a", "run")))
    assert is_stop(asking(Priority.STOP))
    assert not is_stop(asking(Priority.OPERATOR_WRITE))
    assert not is_stop(Alive())


# The process itself


@pytest.fixture
def listener(tmp_path: Any) -> Iterator[tuple[subprocess.Popen[str], socket.socket]]:
    """A process that listens, and a connection to it."""
    path = str(tmp_path / "s")
    process = subprocess.Popen(
        [sys.executable, "-c", LISTENS, path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(path)
        yield process, connection
    process.kill()
    process.communicate()


def owner(pid: int, name: str = KEEPER, version: int = VERSION) -> Owner:
    return Owner(version, Program("k", name, pid), "socket")


def test_kill_ends_the_process_at_the_other_end(listener: Any) -> None:
    process, connection = listener
    os.kill(process.pid, signal.SIGSTOP)
    keeper = KeeperProcess(owner(process.pid), connection)
    assert keeper.kill()
    assert process.wait(20) == -signal.SIGKILL
    # another program was quicker
    assert keeper.kill()
    assert keeper.remedy == STAYS
    keeper.close()


def test_only_a_known_keeper_is_killed(listener: Any) -> None:
    process, connection = listener
    for item in (owner(process.pid, name="panel"), owner(process.pid, version=VERSION + 1)):
        found = KeeperProcess(item, connection)
        assert not found.kill()
        assert found.remedy == BY_HAND.format(pid=process.pid)
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        found = KeeperProcess(owner(other.pid), connection)
        assert not found.kill()
        # the lock file is behind: what is at the other end is named
        assert found.remedy == BY_HAND.format(pid=process.pid)
        assert other.poll() is None
        other.kill()
    assert process.poll() is None


def test_keeper_in_another_container_is_named_as_such(
    listener: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    process, connection = listener
    elsewhere = Owner(VERSION, Program("k", KEEPER, process.pid, space="pid:[1]"), "socket")
    found = KeeperProcess(elsewhere, connection)
    assert not found.kill()
    assert found.remedy == OTHER_CONTAINER
    # the system shows it, not the lock file: no process here has its number
    monkeypatch.setattr("tui.bus.share.owner_watch.peer_of", lambda _: Peer(0, os.getuid()))
    assert KeeperProcess(owner(process.pid), connection).remedy == OTHER_CONTAINER
    assert process.poll() is None


def test_keeper_without_a_known_peer_is_not_killed(
    listener: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    process, connection = listener
    monkeypatch.setattr("tui.bus.share.owner_watch.peer_of", lambda _: None)
    found = KeeperProcess(owner(process.pid), connection)
    assert not found.kill()
    assert found.remedy == BY_HAND.format(pid=process.pid)


def test_reused_pid_is_not_killed(listener: Any) -> None:
    process, connection = listener
    process.kill()
    with suppress(ConnectionResetError):
        connection.recv(1)
    # its number is not free yet, and could soon be that of another process
    assert not KeeperProcess(owner(process.pid), connection).kill()


def test_keeper_of_another_user_is_not_killed(
    listener: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    process, connection = listener

    def refused(*_: object) -> None:
        raise PermissionError

    monkeypatch.setattr(signal, "pidfd_send_signal", refused)
    keeper = KeeperProcess(owner(process.pid), connection)
    assert not keeper.kill()
    assert keeper.remedy == OTHER_USER.format(pid=process.pid)
    keeper.close()
