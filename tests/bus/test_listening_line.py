"""A port that is listened to: reading only, and for one program alone."""

from __future__ import annotations

import fcntl
import os
import pty
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from tui.bus.errors import LineLost, NotShared, PortBusy, PortMissing, PortRefused
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.listening_line import ListeningLine
from tui.bus.program import Program
from tui.bus.share.place import SharePlace
from tui.bus.transport.ports import see_port
from tui.bus.transport.serial_listening import open_listening

ME = Program("1", "listen", os.getpid())


class Talk:
    """A pseudo-terminal with traffic from its other end."""

    def __init__(self) -> None:
        self.ours, self.theirs = pty.openpty()
        tty.setraw(self.theirs)
        self.path = os.ttyname(self.theirs)

    def close(self) -> None:
        for number in (self.ours, self.theirs):
            if number >= 0:
                os.close(number)
        self.ours = self.theirs = -1


@pytest.fixture
def talk() -> Iterator[Talk]:
    made = Talk()
    yield made
    made.close()


@pytest.fixture
def place(tmp_path: Path) -> SharePlace:
    return SharePlace("serial:x", tmp_path / "lines", (tmp_path / "run",))


def test_bytes_are_read_as_they_arrive(talk: Talk) -> None:
    with ListeningLine(SerialLink(talk.path), None, ME) as line:
        assert line.read(0.0) == b""
        os.write(talk.ours, b"\x02\x03\x00\r\n\x1a\x11")
        assert line.read(5.0) == b"\x02\x03\x00\r\n\x1a\x11"
        assert not line.has_times
        assert line.character == 0.0


def test_port_is_opened_read_only(talk: Talk) -> None:
    with ListeningLine(SerialLink(talk.path), None, ME):
        opened = [int(fd) for fd in os.listdir("/proc/self/fd") if _leads_to(int(fd)) == talk.path]
        (port,) = [fd for fd in opened if fd != talk.theirs]
        assert fcntl.fcntl(port, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.write(port, b"x")
    assert _leads_to(port) != talk.path


def _leads_to(descriptor: int) -> str:
    try:
        return os.readlink(f"/proc/self/fd/{descriptor}")
    except OSError:
        return ""


def test_port_that_disappears_is_reported(talk: Talk) -> None:
    with ListeningLine(SerialLink(talk.path), None, ME) as line:
        talk.close()
        with pytest.raises(LineLost, match="disappeared"):
            line.read(5.0)


def test_port_is_monitored_by_one_program_at_a_time(talk: Talk) -> None:
    with ListeningLine(SerialLink(talk.path), None, ME):
        with pytest.raises(PortBusy), ListeningLine(SerialLink(talk.path), None, ME):
            pass
        with pytest.raises(PortBusy):
            open_listening(talk.path, 19200, "8E1")
    with ListeningLine(SerialLink(talk.path), None, ME):
        pass


def test_program_that_has_a_real_port_open_is_named(
    talk: Talk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.listening_line.others_at", lambda _path: "mbpoll (pid 7)")
    with (
        pytest.raises(PortBusy, match=r"mbpoll \(pid 7\)"),
        ListeningLine(SerialLink(talk.path), None, ME),
    ):
        pass


def test_line_owned_by_another_drivepanel_is_refused(talk: Talk, place: SharePlace) -> None:
    owner = Line(SerialLink(talk.path), place=place, program=Program("2", "panel", os.getpid()))
    owner.open(wait=5.0)
    try:
        with (
            pytest.raises(
                NotShared, match=r"drivepanel panel \(pid \d+\) has .* Frames .* of a panel"
            ),
            ListeningLine(SerialLink(talk.path), place, ME),
        ):
            pass
    finally:
        owner.close()
    with ListeningLine(SerialLink(talk.path), place, ME):
        pass


def test_monitored_line_is_refused_to_other_programs(
    talk: Talk, place: SharePlace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.share.sharing.NO_OWNER", 0.1)
    late = Line(SerialLink(talk.path), place=place, program=Program("2", "panel", os.getpid()))
    with ListeningLine(SerialLink(talk.path), place, ME):
        try:
            with pytest.raises(NotShared, match=r"listen \(pid \d+\) holds the line"):
                late.open(wait=5.0)
        finally:
            late.close()


def test_unusable_port_is_refused(talk: Talk, tmp_path: Path) -> None:
    with pytest.raises(PortMissing):
        open_listening(str(tmp_path / "none"), 19200, "8E1")
    with pytest.raises(PortRefused, match="12345 baud"):
        open_listening(talk.path, 12345, "8E1")
    with pytest.raises(PortRefused):
        open_listening(str(tmp_path), 19200, "8E1")


def test_gap_and_character_time_follow_the_settings(
    talk: Talk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.listening_line.is_pseudo_terminal", lambda _path: False)
    line = ListeningLine(SerialLink(talk.path, 9600, "8N1"), None, ME)
    assert line.character == pytest.approx(10 / 9600)
    assert line.silence == pytest.approx(35 / 9600)


def test_invalid_port_is_reported_as_invalid_not_busy(tmp_path: Path) -> None:
    """Every program has /dev/null open: `listen` named all of them."""
    notes = tmp_path / "notes"
    with notes.open("w"):
        for path in ("/dev/null", str(tmp_path), str(notes)):
            seen = see_port(path)
            assert not seen.holder
            assert not seen.others
            line = ListeningLine(SerialLink(path, 19200, "8E1"), None, ME)
            with pytest.raises(PortRefused, match="it is not a serial port"):
                line.__enter__()
