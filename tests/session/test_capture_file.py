"""The file of frames: whole at every moment, on a disk that is full as well."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tui.session.capture_file import CaptureFile

READ = bytes.fromhex("0318750005")


class FullDisk:
    """A file that accepts this many bytes, and then a part of a write, or nothing."""

    def __init__(self, file: Any, room: int) -> None:
        self._file = file
        self._room = room

    def write(self, data: bytes) -> int:
        taken = data[: self._room]
        self._room -= len(taken)
        return int(self._file.write(taken))

    def truncate(self, size: int) -> None:
        self._file.truncate(size)

    def close(self) -> None:
        self._file.close()


def test_packet_that_does_not_fit_leaves_the_file_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "x.pcapng"
    file = CaptureFile(path, "line")
    file.add_frame(1, READ, 1.0, request=True)
    whole = path.read_bytes()
    file._file = FullDisk(file._file, 30)  # type: ignore[assignment]
    with pytest.raises(OSError, match="No space"):
        file.add_frame(1, READ, 2.0, request=True)
    file.close()
    assert path.read_bytes() == whole
    assert file.packets == 1


def test_noise_is_a_packet_in_the_raw_form_only(tmp_path: Path) -> None:
    raw, tcp = CaptureFile(tmp_path / "a", "line", raw=True), CaptureFile(tmp_path / "b", "line")
    for file in (raw, tcp):
        file.add_noise(b"\x00", 1.0)
        file.add_frame(1, READ, 1.0, request=True)
        file.close()
    assert (raw.packets, tcp.packets) == (2, 1)
    assert b"before it, no frame: 00" in (tmp_path / "b").read_bytes()


def test_file_whose_header_does_not_fit_is_closed_and_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[Any] = []
    open_file = Path.open

    def full(path: Path, *how: Any, **more: Any) -> Any:
        opened.append(open_file(path, *how, **more))
        return FullDisk(opened[0], 30)

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(OSError, match="No space"):
        CaptureFile(tmp_path / "x.pcapng", "line")
    assert opened[0].closed
