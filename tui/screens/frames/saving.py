"""Saving of frames to a file, for tshark or as text; the user may change the file name."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tui.bus.api import Frame
from tui.drive.sentences import counted
from tui.session.capture_file import CaptureFile
from tui.session.paths import state_folder

if TYPE_CHECKING:
    from ..app_port import Panel

RAW_NAME, TEXT_NAME = ".raw.pcapng", ".txt"
"""Endings of file names: frames as on the line, and text."""
SAVED_FRAMES = "Saved: 1 frame in {path}", "Saved: {count} frames in {path}"
SAVED_AS = (
    "The ending sets the form. .pcapng: Modbus/TCP, for tshark. .raw.pcapng: RTU with checksums."
    " .txt: text, one line per frame."
)


class KeptFrames(NamedTuple):
    """Frames to save, with the other data that the file needs."""

    frames: Sequence[Frame]
    text: str
    """All frames as text, for a text file."""
    line: str
    tcp: bool
    since_epoch: float
    """Seconds to add to a frame's time to get seconds since 1970."""


def ask_where(app: Panel, kept: KeptFrames) -> None:
    """Ask for a file name, and save the frames; the ending sets the format."""
    from ..dialogs.ask import Ask, fault_of_new

    if not kept.frames:
        app.tell("Nothing to save: no frame is shown.")
        return
    name = time.strftime("frames-%Y%m%d-%H%M%S.pcapng", time.localtime(app.panel_clock.wall()))

    def reported(answer: str | None) -> None:
        if answer:
            _save(app, Path(answer).expanduser(), kept)

    requested = Ask(
        "Save the frames as",
        fault_of_new,
        text=str(state_folder() / name),
        about=SAVED_AS,
        takes="Save",
    )
    app.push_screen(requested, reported)


def _save(app: Panel, path: Path, kept: KeptFrames) -> None:
    try:
        count = save_frames(path, kept)
    except OSError as error:
        app.notify(f"Not saved: {error.strerror or error}: {path}", severity="error")
    else:
        app.tell(counted(count, *SAVED_FRAMES, path=path))


def save_frames(path: Path, kept: KeptFrames) -> int:
    """Write frames to a new file, and return how many it has. Raises OSError, also if it exists.

    Frames of Modbus TCP have no raw form and are always saved as Modbus/TCP.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.name.endswith(TEXT_NAME):
        with path.open("x", encoding="utf-8") as text:
            text.write(kept.text)
        return len(kept.frames)
    raw = path.name.endswith(RAW_NAME) and not kept.tcp
    file = CaptureFile(path, kept.line, raw=raw)
    try:
        for frame in kept.frames:
            file.add_seen(frame, kept.since_epoch + frame.time, tcp=kept.tcp)
    finally:
        file.close()
    return file.packets
