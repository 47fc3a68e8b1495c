"""An invented record: an Altivar 71 for 200 s, with all that a record may have."""

from __future__ import annotations

import json
import sqlite3
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile, digest_of
from tui.session.record.record_file import RecordFile
from tui.session.record.ring import record_path
from tui.session.record.schema import EventRow, ReplyRow

BEGIN = 1_795_000_000
LINE = "serial:/dev/ttyUSB0,9600,8N1"
ATV71 = load("atv71")
QUALITY_OF = {"good": 0, "refused": 1, "silent": 2, "damaged": 3, "wrong": 4, "copy": 5, "sent": 7}


def reply(
    at: float, words: Sequence[int] = (), address: int = 3201, *, device: int = 1,
    quality: str = "good", registers: int = 0, function: int = 3, repeat: int = 0,
    took: float = 0.01, received: bytes | None = None, sent: bytes | None = None, who: str = "",
) -> ReplyRow:  # fmt: skip
    """A row whose reply ends at a time in seconds after the begin."""
    end, lasts = round((BEGIN + at) * 1e6), round(took * 1e6)
    data = b"".join(word.to_bytes(2, "big") for word in words) or None
    return ReplyRow(
        end - lasts, end - lasts, lasts, device, function, address, registers or len(words),
        QUALITY_OF[quality], data, sent, received, repeat, who,
    )  # fmt: skip


def event(at: float, kind: str, text: str, device: int | None = None, who: str = "") -> EventRow:
    when = round((BEGIN + at) * 1e6)
    return EventRow(when, when, device, kind, text, who)


def profile(at: float, family: str | Profile, device: int = 1, *, digest: str = "") -> EventRow:
    """The event that names a drive's profile; without `digest` it is as installed."""
    found = load(family) if isinstance(family, str) and not digest else family
    name = found if isinstance(found, str) else found.id
    digest = digest if isinstance(found, str) else digest_of(found)
    about = {"profile": name, "hash": digest, "reference": "ATV71HU15N4", "version": "V1.2"}
    return event(at, "profile", json.dumps(about), device)


def block(at: float, **places: str) -> EventRow:
    return event(
        at, "block", json.dumps({"places": {key[1:]: at for key, at in places.items()}}), 1
    )


READY, RUN, BACK, STOP, FAULT = 0x0233, 0x0637, 0x8637, 0x0633, 0x0238
LFT = ATV71["LFT"].address
ACC, INR = ATV71["ACC"].address, ATV71["INR"].address
MANY = ATV71["SMIL"].address
BLOCK = ATV71.data.blocks[0].address


def drive_rows() -> Iterator[ReplyRow]:
    """An Altivar 71 for 200 s: two runs, a trip, times without replies, settings of two scales."""
    for at in range(200):
        word = READY
        if 20 <= at < 50 or 120 <= at < 130:
            word = RUN if at < 100 else BACK
        elif 130 <= at < 133:
            word = STOP
        elif 70 <= at < 80:
            word = FAULT
        speed = min(300, 15 * (at - 20)) if word == RUN else 0
        if 85 <= at < 95:  # silent, and then for one try only
            yield reply(at, quality="silent", registers=4)
            continue
        if at == 100:
            yield reply(at, quality="damaged", registers=4, received=b"\1\3\x09")
            yield reply(at + 0.05, (word, 0, 0, 3), repeat=1)
            continue
        if 150 <= at < 160:
            continue
        reference = 65536 - 250 if word == BACK else 300 + (at == 30) * 5
        yield reply(at, (word, speed, reference, 84 + at % 3))
        yield reply(at + 0.03, (18 if word == FAULT else 0,), LFT)
        if at in (19, 119):
            yield reply(at + 0.5, (15,), 8501, function=6, who="panel (12)" if at == 19 else "")
        if at % 40 == 5:
            yield reply(at + 0.1, (30 + at,), ACC)
            yield reply(at + 0.12, (at // 40 % 2,), INR)
            yield reply(at + 0.14, (at, 1), MANY)
        if at % 10 == 3:
            yield reply(at + 0.2, (at, 0x8000), BLOCK, took=0.02)
        if at == 60:
            yield reply(at + 0.3, quality="refused", registers=1, address=9999, received=b"\x83\2")
            yield reply(at + 0.4, quality="wrong", registers=1, address=9998, received=b"\1\3\2")
            yield reply(at + 0.5, quality="copy", registers=1, address=9997, received=b"\3\2\0\1")


DRIVE_EVENTS = (
    profile(0.5, "atv71"), block(12.5, r12741="THD"), event(69.9, "fault", "Tripped.", 1),
    block(100.5, r12741="THD", r12742="LCR"), event(40.5, "stop", "Stop all", 1, "panel (12)"),
    event(151, "line", "lost The adapter was unplugged."), event(159, "line", "connected"),
    event(165, "notice", "A note."), event(170, "commander", "x", 2), event(171, "other", "y"),
)  # fmt: skip


@contextmanager
def written(
    *parts: tuple[Sequence[ReplyRow], Sequence[EventRow]], expired: float = 0.0
) -> Iterator[list[Path]]:
    """A file for each part, in a folder for the time of its use.

    Reads up to so many seconds after the begin are only reduced.
    """
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for number, (replies, events) in enumerate(parts):
            path = record_path(Path(folder), "line-1", BEGIN // 86400 + number)
            file = RecordFile(path, LINE, "test")
            file.write(replies, events)
            file.close()
            with closing(sqlite3.connect(path)) as base, base:
                until = round((BEGIN + expired) * 1e6)
                base.execute("DELETE FROM reply WHERE utc < ? AND function < 5", (until,))
            paths.append(path)
        yield paths


def seconds(at: float | None) -> float | None:
    return None if at is None else round(at - BEGIN, 3)
