"""Meeting place of programs on one line: by device, in a folder of this user, or none."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.bus.peer import PtyPeer, eventually, honest
from tests.bus.sharing import QUICK
from tui.bus.errors import PortBusy
from tui.session.connect.open_line import OpenLine, open_line
from tui.session.connect.share_place import share_place, this_program


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch, patience: None) -> None:
    """Lines are taken over quickly."""
    monkeypatch.setattr("tui.bus.line.timing_of", lambda _: QUICK)
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)


def others(opened: OpenLine) -> list[str]:
    return [other.name for other in opened.line.facts.others]


def test_line_is_identified_by_its_device_in_any_spelling(tmp_path: Path) -> None:
    with PtyPeer(honest) as peer:
        by_id = tmp_path / "usb-adapter"
        by_id.symlink_to(peer.path)
        spellings = [
            f"serial:{peer.path},19200,8N1", f"serial:{by_id}", f"serial:{os.path.realpath(by_id)}"
        ]  # fmt: skip
        opened: list[OpenLine] = []
        try:
            for number, text in enumerate(spellings):
                opened.append(open_line(text, wait=5, program=f"program{number}"))
            eventually(lambda: sorted(others(opened[0])) == ["program1", "program2"])
            # with settings that were meant otherwise it says as what it is open
            assert "It is open as" not in opened[0].line.state.reason
            assert "19200" in opened[1].line.state.reason
        finally:
            for line in opened:
                line.close()


def test_program_without_a_name_shares_nothing(tmp_path: Path) -> None:
    with PtyPeer(honest) as peer:
        opened = open_line(f"serial:{peer.path}", wait=5)
        try:
            assert opened.line.facts.voice is None
            assert not (Path(os.environ["DRIVEPANEL_STATE"]) / "lines").exists()
        finally:
            opened.close()


def test_socket_is_in_the_runtime_folder_or_the_state_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    state = Path(os.environ["DRIVEPANEL_STATE"])
    place = share_place("tcp:gateway")
    assert place is not None
    assert place.socket_folders == (state / "run",)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    place = share_place("tcp:gateway")
    assert place is not None
    assert place.socket_folders == (tmp_path / "runtime/drivepanel", state / "run")
    assert place.lock_folder == state / "lines"


@pytest.mark.parametrize("runtime", ["gone/for/good", "a file", "long" * 40])
def test_two_programs_meet_with_any_runtime_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, runtime: str
) -> None:
    (tmp_path / "a file").write_text("")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / runtime))
    with PtyPeer(honest) as peer:
        first = open_line(f"serial:{peer.path}", wait=5, program="first")
        second = open_line(f"serial:{peer.path}", wait=5, program="second")
        try:
            eventually(lambda: others(first) == ["second"])
        finally:
            second.close()
            first.close()


def test_line_works_unshared_if_folder_cannot_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "file"))
    with PtyPeer(honest) as peer:
        first = open_line(f"serial:{peer.path}", wait=5, program="first")
        try:
            assert first.line.facts.voice is None
            # and a second program is refused as always
            with pytest.raises(PortBusy, match="in use"):
                open_line(f"serial:{peer.path}", wait=5, program="second")
        finally:
            first.close()


def test_system_without_local_sockets_shares_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.share_place.os.name", "nt")
    assert share_place("tcp:gateway") is None


def test_program_has_its_kind_and_pid_as_name() -> None:
    me, other = this_program("panel"), this_program("panel")
    assert me.id != other.id
    assert me.text.startswith("panel")
    assert me.text.endswith(f"(pid {os.getpid()})")
