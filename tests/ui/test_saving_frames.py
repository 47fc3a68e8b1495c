"""Frames saved from their screen: as tshark reads them, raw, and as text."""

from __future__ import annotations

import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from textual.widgets import Input

from tests.programs import PATIENCE
from tui.app import DrivePanelApp
from tui.bus.api import Frame
from tui.screens.dialogs.ask import Ask
from tui.screens.frames.frame_view import frames_text
from tui.screens.frames.saving import KeptFrames, save_frames
from tui.screens.frames.screen import FramesScreen
from tui.wire.frames import is_whole, sealed

from .test_flows import demo, shown, to_monitor, until

Peer = Callable[[str, str], str]

REQUEST, REPLY = sealed(bytes.fromhex("02030c810001")), sealed(bytes.fromhex("0203020637"))
FRAMES = (
    Frame(1.0, "out", REQUEST),
    Frame(1.01, "in", b"\x00\x02"),
    Frame(1.02, "in", REPLY),
)
WORDS = ("2 read ETA", "", "2 ETA 16#0637")


def save(path: Path, frames: tuple[Frame, ...] = FRAMES, *, tcp: bool = False) -> int:
    """Save frames as the screen does; the line's clock began at the time 100."""
    words = WORDS if len(frames) == len(WORDS) else [""] * len(frames)
    text = frames_text(frames, range(len(frames)), words, 100.0, ["serial:x"])
    return save_frames(path, KeptFrames(frames, text, "serial:x", tcp, 100.0))


def packets(path: Path) -> list[bytes]:
    """The packets of a pcapng file."""
    data, found, at = path.read_bytes(), [], 0
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        if kind == 6:
            size = struct.unpack_from("<I", data, at + 20)[0]
            found.append(data[at + 28 : at + 28 + size])
        at += length
    return found


def test_frames_are_saved_in_modbus_tcp_form(peer: Peer, tmp_path: Path) -> None:
    path = tmp_path / "new" / "frames.pcapng"
    assert save(path) == 2
    wanted = ("mbtcp.unit_id", "modbus.regval_uint16", "frame.time_epoch", "frame.comment")
    done = subprocess.run(
        [peer("tshark", "tshark"), "-r", str(path), "-T", "fields", "-E", "separator=;",
         *(part for text in wanted for part in ("-e", text))],
        capture_output=True, text=True, timeout=PATIENCE, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines() == [
        "2;;101.000000000;",
        "2;1591;101.020000000;before it, no frame: 00 02",
    ]


def test_frames_are_saved_raw(tmp_path: Path) -> None:
    path = tmp_path / "frames.raw.pcapng"
    assert save(path) == 3
    assert packets(path) == [REQUEST, b"\x00\x02", REPLY]


def test_modbus_tcp_frames_have_one_form(tmp_path: Path) -> None:
    head = bytes.fromhex("000100000006")
    frames = (Frame(1.0, "out", head + REQUEST[:-2]), Frame(1.1, "in", b"\x00"))
    for name in ("a.pcapng", "a.raw.pcapng"):
        save(tmp_path / name, frames, tcp=True)
        (packet,) = packets(tmp_path / name)
        assert packet[46:] == REQUEST[:-2]


def test_frames_are_saved_as_text(tmp_path: Path) -> None:
    path = tmp_path / "frames.txt"
    assert save(path) == 3
    head, columns, *lines = path.read_text("utf-8").splitlines()
    assert (head, columns.split("\t")[-1]) == ("# serial:x", "bytes")
    reported = [line.split("\t") for line in lines]
    assert [row[2:] for row in reported] == [
        ["request", "2 read ETA", "", "02 03 0C 81 00 01 D7 41"],
        ["reply", "", "", "00 02"],
        ["reply", "2 ETA 16#0637", "", "02 03 02 06 37 BE 32"],
    ]


def test_note_does_not_control_terminal() -> None:
    frame = Frame(1.0, "in", b"\x00", "\x1b[2J")
    assert "␛[2J" in frames_text([frame], [0], [""], 0.0, [])


def test_existing_file_is_kept(tmp_path: Path) -> None:
    for name in ("a.pcapng", "a.txt"):
        (tmp_path / name).write_bytes(b"mine")
        with pytest.raises(FileExistsError):
            save(tmp_path / name)
        assert (tmp_path / name).read_bytes() == b"mine"


async def test_ctrl_s_on_frames_asks_for_a_name_and_saves(tmp_path: Path) -> None:
    app = DrivePanelApp(open_line=demo, start="demo")
    file, nowhere = tmp_path / "mine.raw.pcapng", tmp_path / "mine.txt" / "x.txt"
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        await pilot.press("7")
        await until(pilot, lambda: isinstance(app.screen, FramesScreen))
        await until(pilot, lambda: "j to find" in shown(app, "frames"))
        await pilot.press("ctrl+s")
        await until(pilot, lambda: isinstance(app.screen, Ask))
        assert app.screen.query_one(Input).value.endswith(".pcapng")
        app.screen.query_one(Input).value = str(file)
        await pilot.press("enter")
        await until(pilot, lambda: bool(app.events.newest and "Saved" in app.events.newest.text))
        assert app.events.newest is not None
        assert f"{len(packets(file))} frames in {file}" in app.events.newest.text
        assert all(map(is_whole, packets(file)))
        nowhere.parent.touch()
        await pilot.press("ctrl+s")
        await until(pilot, lambda: isinstance(app.screen, Ask))
        app.screen.query_one(Input).value = str(nowhere)
        await pilot.press("enter")
        await until(
            pilot, lambda: bool(app.events.newest and "Not saved" in app.events.newest.text)
        )
