"""Tables of a record, and the rows that go into them. Times are integers, in microseconds.

`utc` counts from 1970 by the computer's clock as it was then, which may jump. `mono` is the
monotonic clock of the boot that the row's session names, and never does.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from tui.bus.model import EndedExchange
from tui.wire.frames import BIT_READS, bits_of, packed_bits

RECORD_VERSION = 1
"""Version of the tables (`PRAGMA user_version`)."""
RECORD_ID = 0x44505243
"""The file's `PRAGMA application_id`: "DPRC"."""

QUALITIES = {
    0: "good",
    1: "exception",
    2: "no reply",
    3: "damaged reply",
    4: "wrong reply",
    5: "possible copy of the previous reply",
    6: "adapter's echo or reply",
    7: "no reply awaited",
    8: "frame without a request",
}
"""Names of `quality`, which the file has as a table too."""
GOOD, REFUSED, SILENT, DAMAGED, WRONG, COPY, STRAY = 0, 1, 2, 3, 4, 5, 8
RECORDED_READS = (1, 2, 3, 4)
"""Functions whose rows are reduced."""
_READING = (*RECORDED_READS, 23)
_COILS = (5, 15)
"""Functions that write coils."""
_WRITING = {6: 3, 16: 6}
"""Functions that only write, with the place of the words in their requests."""
_WITH_REGISTERS = (*_READING, *_WRITING, *_COILS)
_QUALITY_OF = {
    "reply": 0,
    "exception": 1,
    "nothing": 2,
    "damaged": 3,
    "wrong": 4,
    "copy": 5,
    "unsure": 6,
    "sent": 7,
}

TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE quality (id INTEGER PRIMARY KEY, name TEXT NOT NULL);
CREATE TABLE session (id INTEGER PRIMARY KEY, utc INTEGER NOT NULL, mono INTEGER NOT NULL,
  boot TEXT NOT NULL, program TEXT NOT NULL, version TEXT NOT NULL);
CREATE TABLE who (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE reply (id INTEGER PRIMARY KEY AUTOINCREMENT, session INTEGER NOT NULL,
  utc INTEGER NOT NULL, mono INTEGER NOT NULL, took INTEGER NOT NULL,
  device INTEGER NOT NULL, function INTEGER NOT NULL, address INTEGER, registers INTEGER NOT NULL,
  quality INTEGER NOT NULL, words BLOB, sent BLOB, received BLOB,
  repeat INTEGER NOT NULL, who INTEGER);
CREATE INDEX reply_times ON reply (device, utc);
CREATE TABLE reduced (id INTEGER PRIMARY KEY, session INTEGER NOT NULL,
  utc INTEGER NOT NULL, mono INTEGER NOT NULL, took INTEGER NOT NULL,
  device INTEGER NOT NULL, function INTEGER NOT NULL, address INTEGER, registers INTEGER NOT NULL,
  good INTEGER NOT NULL, bad INTEGER NOT NULL, words BLOB);
CREATE INDEX reduced_times ON reduced (device, utc);
CREATE TABLE event (id INTEGER PRIMARY KEY, session INTEGER NOT NULL,
  utc INTEGER NOT NULL, mono INTEGER NOT NULL, device INTEGER,
  kind TEXT NOT NULL, text TEXT NOT NULL, who INTEGER, data BLOB);
CREATE UNIQUE INDEX event_times ON event (utc, kind, coalesce(device, 0), text);
"""
"""`mono` and `utc` of a reply are those of the request, `took` is from there to the end of the
reply. A row of `reduced` covers `took` from its first reply to its last."""


class RecordHeld(OSError):
    """Another program holds the file, or keeps its log from being emptied."""


class RecordDamaged(OSError):
    """A file is not a record of this version, or its content is damaged."""

    def __init__(self, why: str, path: Path) -> None:
        super().__init__(why)
        self.path = path


class ReplyRow(NamedTuple):
    """One exchange in the table `reply`, with the name of its program."""

    utc: int
    mono: int
    took: int
    device: int
    function: int
    address: int | None
    registers: int
    """Registers, coils or inputs that were read or written; 0 for functions without any."""
    quality: int
    words: bytes | None
    """Registers as on the wire, high byte first: those read, or those written. A coil or input that
    was read is a register of 0 or 1."""
    sent: bytes | None
    """Function and data of a request that the other columns do not give."""
    received: bytes | None
    """Bytes of a reply that has no registers, or is not good."""
    repeat: int
    who: str


class EventRow(NamedTuple):
    """One event in the table `event`; `device` is None for the line."""

    utc: int
    mono: int
    device: int | None
    kind: str
    text: str
    who: str = ""
    data: bytes | None = None


def to_microseconds(seconds: float) -> int:
    """Return a time as an integer of the tables."""
    return round(seconds * 1e6)


def reply_row(ended: EndedExchange, who: str) -> ReplyRow:
    """Return the row of an exchange."""
    request, reply = ended.request, ended.reply
    function, quality = request[0], _QUALITY_OF[ended.result]
    good = quality == GOOD
    address: int | None = None
    registers, words = 0, None
    sent: bytes | None = request
    received: bytes | None = reply or None
    if function in _WITH_REGISTERS:
        address, registers = _number(request, 1), _number(request, 3)
    if function == 5:
        registers = 1
    if function in _READING and good:
        words, received = reply[2:], None
    if function in BIT_READS and words is not None:
        words = b"".join(bit.to_bytes(2, "big") for bit in bits_of(words, registers))
    if function in RECORDED_READS:
        sent = None
    if function in _WRITING:
        registers = 1 if function == 6 else registers
        words, sent = request[_WRITING[function] :], None
        received = None if good else received
    mono = to_microseconds(ended.sent)
    took = max(0, to_microseconds(ended.end) - mono)
    return ReplyRow(
        to_microseconds(ended.wall) - took, mono, took, ended.device, function, address, registers,
        quality, words, sent, received, ended.repeat, who,
    )  # fmt: skip


def read_reply(function: int, words: bytes) -> bytes:
    """Return the good reply with the words of a row."""
    data = packed_bits(words[1::2]) if function in BIT_READS else words
    return bytes([function, len(data)]) + data


def stray_row(ended: EndedExchange, data: bytes) -> ReplyRow:
    """Return the row of a whole frame that came with a reply, or without any request.

    Its own time is not known: it has that of the reply.
    """
    at = to_microseconds(ended.wall), to_microseconds(ended.end)
    return ReplyRow(*at, 0, data[0], 0, None, 0, STRAY, None, None, data, 0, "")


def _number(pdu: bytes, at: int) -> int:
    return pdu[at] << 8 | pdu[at + 1]
