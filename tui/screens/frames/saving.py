"""The frames of the line in a file: for tshark, or as text."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from tui.bus.api import Frame
from tui.drive.plain import plain
from tui.session.capture_file import CaptureFile
from tui.wire.frames import hex_text, is_whole

from .decoded import MBAP_BYTES, pdu_of

RAW_NAME, TEXT_NAME = ".raw.pcapng", ".txt"
"""How a name ends that is for frames as they are on the line, or for text."""
SAVED_AS = (
    "pcapng as Modbus/TCP, which tshark decodes at once; a name with .raw.pcapng as RTU with its"
    " checksums, one with .txt as text."
)

WallOf = Callable[[float], float]
"""The time since 1970 of a time of the line's clock."""


def save_frames(
    path: Path,
    frames: Sequence[Frame],
    words: Sequence[str],
    line: str,
    *,
    tcp: bool,
    wall_of: WallOf,
    time_text: Callable[[float], str],
) -> int:
    """Write frames to a new file, in the form that its name asks for; how many it holds.

    `words` are what each frame says. Frames of Modbus TCP have no other form than that. Raises
    OSError.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.name.endswith(TEXT_NAME):
        with path.open("x", encoding="utf-8") as text:
            for frame, said in zip(frames, words, strict=True):
                text.write(f"{frame_text(frame, said, time_text(wall_of(frame.time)))}\n")
        return len(frames)
    raw = path.name.endswith(RAW_NAME) and not tcp
    file = CaptureFile(path, line, raw=raw)
    try:
        for frame in frames:
            _add(file, frame, wall_of(frame.time), tcp=tcp)
    finally:
        file.close()
    return file.packets


def frame_text(frame: Frame, words: str, at: str) -> str:
    """One frame as a line of text: time, direction, bytes, what it says, and its note."""
    direction = "out" if frame.direction == "out" else "in "
    said = "  ".join(part for part in (words, frame.note) if part)
    return plain(f"{at}  {direction}  {hex_text(frame.data)}  {said}".rstrip())


def _add(file: CaptureFile, frame: Frame, wall: float, *, tcp: bool) -> None:
    pdu = pdu_of(frame.data, tcp=tcp)
    whole = len(frame.data) > MBAP_BYTES if tcp else is_whole(frame.data)
    if pdu is None or not whole:
        file.add_noise(frame.data, wall)
        return
    body = bytes([pdu.function]) + pdu.body
    file.add_frame(pdu.device, body, wall, request=frame.direction == "out")
