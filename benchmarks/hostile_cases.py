"""Randomly damaged input from files, drives and people: one function per kind.

Each takes a random source and a folder of its own, makes one case, and uses it as the panel would.
Any exception other than an error reported in a sentence is a defect.
"""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

from tui.bus.errors import LineError
from tui.bus.requests import (
    Diagnose,
    Identify,
    Objects,
    Read,
    ReadWrite,
    Request,
    WriteMany,
    WriteOne,
    diagnostic_of,
)
from tui.bus.rtu.exchange import RtuExchange
from tui.drive.blocks.assignment import Assignment
from tui.drive.blocks.file import dump_blocks, load_blocks
from tui.drive.chart import read_chart
from tui.drive.errors import DriveError
from tui.drive.plain import commands
from tui.drive.profile import heads, library
from tui.drive.profile.profile import Profile
from tui.drive.settings.compare import compare_settings, factory_side, side_of
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.drive.settings.set_file import read_set
from tui.drive.shown import shown
from tui.drive.small_file import read_small_text
from tui.session.journal import Entry, now_text
from tui.wire.frames import sealed

TOLD = (DriveError, LineError)
"""Errors whose text is a sentence for a person."""
ODD_VALUES = (
    "-1", "0", "1", "65535", "65536", "-32769", "4294967296", "9" * 30, "9" * 5000, "1e400", "nan",
    "-inf", "0.1", "true", '""', '"x"', '"0.1"', '"nan"', '"1e999999999"', '"-0"', "[]", "{}",
    "[[]]", "[1, \"a\"]", "1979-05-27", '"' + "A" * 5000 + '"', '"\\u001b]0;x\\u0007"',
    '"\\u202e\\u0000"', '"../../etc/passwd"', '"٣"', "16#1", '["ACC"]', "{ raw = 1 }",
)  # fmt: skip
ODD_BYTES = (
    b"\0", b"\xff", b"\x1b]0;x\x07", b"\n", b'"', b"[", b"]", b"=", b"'''", b"\xed\xa0\x80",
)  # fmt: skip
FAMILIES = ("varmeca", "proxidrive", "powerdrive", "atv21", "atv312", "atv31")

Case = Callable[[random.Random, Path], None]


def mutated(text: bytes, chance: random.Random) -> bytes:
    """A text with one to four wounds: bytes, lines, values, its end."""
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        text = chance.choice(_WOUNDS)(text, chance)
    return text


def _bytes(text: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(text) + 1)
    put = chance.choice((*ODD_BYTES, chance.randbytes(3)))
    return text[:at] + put + text[at + chance.choice((0, 1, len(put))) :]


def _cut(text: bytes, chance: random.Random) -> bytes:
    return text[: chance.randrange(len(text) + 1)]


def _lines(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    number, other = chance.randrange(len(lines)), chance.randrange(len(lines))
    match chance.randrange(4):
        case 0:
            del lines[number]
        case 1:
            lines.insert(other, lines[number])
        case 2:
            lines[number], lines[other] = lines[other], lines[number]
        case _:
            del lines[number : number + chance.randrange(1, 40)]
    return b"\n".join(lines)


def _value(text: bytes, chance: random.Random) -> bytes:
    """Replace the value after an equals sign or a colon."""
    found = list(re.finditer(rb"(?:= |: )([^\n,}\]]+)", text))
    if not found:
        return text
    place = chance.choice(found)
    put = chance.choice(ODD_VALUES).encode()
    return text[: place.start(1)] + put + text[place.end(1) :]


def _key(text: bytes, chance: random.Random) -> bytes:
    found = list(re.finditer(rb'\b[\w-]{1,40}(?= = )|"\w{1,40}"(?=:)', text))
    if not found:
        return text
    place, other = chance.choice(found), chance.choice(found)
    return text[: place.start()] + other[0] + text[place.end() :]


def _nested(text: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(text) + 1)
    depth = chance.choice((5, 30, 3000, 60_000))
    put = chance.choice((b"[", b"{a=", b"a.", b'{"a":', b"[[a]]\n"))
    return text[:at] + put * depth + text[at:]


_WOUNDS = (_bytes, _cut, _lines, _value, _value, _value, _key, _nested)


def no_commands(text: str) -> None:
    """Raise AssertionError where a text could command a terminal."""
    assert not any(commands(c) for c in text if c != "\n"), ascii(text[:300])


# Profiles


@lru_cache(maxsize=8)
def _profile_text(family: str) -> bytes:
    found = next(listing for listing in library.listings() if listing.id == family)
    return found.path.read_bytes()


def profile_case(chance: random.Random, folder: Path) -> None:
    """A profile of a person's own: listed, checked, and used where nothing is found wrong."""
    family = chance.choice(FAMILIES[:3] if chance.random() < 0.7 else FAMILIES)
    path = folder / f"{family}.toml"
    path.write_bytes(mutated(_profile_text(family), chance))
    heads.file_head(path, True, library.packaged_folder())
    heads.request_prefixes(path, True, library.packaged_folder())
    for own in (True, False):
        heads.quick_head(path, own)
    faults = library.all_faults_of(path)
    try:
        profile = library.load_file(path)
    except TOLD:
        if not faults:
            raise RuntimeError("no fault was found, and it cannot be used") from None
        return
    _use(profile, chance)


def _use(profile: Profile, chance: random.Random) -> None:
    """Show every parameter of a drive that holds anything, and its state."""
    from tui.drive.family_page import family_page, page_lines

    raws = {item.code: chance.randrange(0x10000) for item in profile.parameters}
    try:
        for parameter in profile.parameters:
            shown(profile, parameter, raws[parameter.code], raws, frozenset())
        read_chart(profile, raws)
        no_commands("".join(line.text for line in page_lines(family_page(profile), 80)))
    except TOLD:
        return


# Parameter sets and block files


def _whole_set(profile: Profile, chance: random.Random) -> ParameterSet:
    raws = {p.code: chance.randrange(0x8000) for p in profile.parameters if chance.random() < 0.9}
    head = SetHead(
        profile=profile.id,
        profile_version="1",
        family=profile.name,
        time=now_text(),
        line="tcp:x:502",
        device=1,
        panel="0.2",
        identity={"reference": "X\x1b]0;x\x07"},
    )
    return ParameterSet(head, raws)


def set_case(chance: random.Random, folder: Path) -> None:
    """A parameter set edited by another source: read, compared, reported."""
    from tui.session.report import report_text

    profile = library.load(chance.choice(FAMILIES))
    path = folder / "set.toml"
    path.write_bytes(mutated(dump_set(profile, _whole_set(profile, chance)).encode(), chance))
    try:
        values = read_set(path)
        named = library.load(values.head.profile)
    except TOLD:
        return
    compare_settings(named, factory_side(named, values), side_of("file", values))
    no_commands(report_text(named, values, []))


def block_case(chance: random.Random, folder: Path) -> None:
    """An assignment file edited by another source."""
    profile = library.load(chance.choice(("atv21", "atv71", "atv31", "atv312")))
    plans = [
        Assignment(block, tuple(chance.choice((0, chance.randrange(0x10000))) for _ in block.slots))
        for block in profile.data.blocks
    ]
    path = folder / "blocks.toml"
    path.write_bytes(mutated(dump_blocks(profile, plans, "note").encode(), chance))
    try:
        load_blocks(read_small_text(path), path.name, profile)
    except (UnicodeDecodeError, *TOLD):
        return


# The state folder


def _state_files(chance: random.Random) -> Mapping[str, object]:
    entry = Entry("now", "tcp:x:502", 1, "atv71", "ACC", 9001, 0, "0", 1, "1", "ok", 1, "test")
    started = {
        "line": "tcp:x:502", "device": 1, "profile": "atv71", "vendor": "", "reference": "",
        "version": "", "name": "", "order": "forward", "boot_id": "b", "pid": 99999999,
        "started": "1", "program": "run", "left_running": False, "wall": now_text(),
    }  # fmt: skip
    return {
        "recent-lines.json": ["sim:atv71", "tcp:x:502"],
        "addresses.json": {"tcp:x:502": "1-10"},
        "marks-atv71.json": {"favourites": ["ACC"], "confirmed": ["DEC"], "recent": ["ACC"]},
        "user-words.json": {"tcp:x:502 1 atv71": [{"address": 3201, "format": "hex"}]},
        "terminals.json": ["xterm"],
        "restore-tcp-x-502-1-atv71.json": {"begun": now_text(), "parameters": 5, "set": "t"},
        "journal.jsonl": asdict(entry),
        "starts/one.json": started,
        "taught/": {
            "line": "tcp:x:502", "device": 1, "profile": "powerdrive", "drive": "",
            "reference": "1.21", "looks": {"5.01": [{"raw": 500, "shown": "50.0 Hz"}]},
        },
    }  # fmt: skip


def state_case(chance: random.Random, folder: Path) -> None:
    """One file of the state folder, of any content or kind: read, and rewritten."""
    from tui.session.teaching.teacher import TaughtDrive

    os.environ["DRIVEPANEL_STATE"] = str(folder)
    taught = TaughtDrive("tcp:x:502", 1, "powerdrive", "")
    name, held = chance.choice(list(_state_files(chance).items()))
    path = taught.file if name == "taught/" else folder / name
    path.parent.mkdir(exist_ok=True)
    _put(path, json.dumps(held).encode() + b"\n", chance)
    _read_state(folder, taught)


def _put(path: Path, text: bytes, chance: random.Random) -> None:
    match chance.randrange(30):
        case 0:
            os.mkfifo(path)
        case 1:
            path.mkdir()
        case 2:
            path.symlink_to(path)
        case 3:
            path.symlink_to("/dev/zero")
        case 4:
            path.write_bytes(b"[" * 300_000)
        case 5:
            with path.open("wb") as file:
                file.truncate(50_000_000_000)
        case 6:
            path.write_bytes(chance.randbytes(chance.randrange(3000)))
        case _:
            path.write_bytes(mutated(text, chance))


def _read_state(folder: Path, taught: Any) -> None:
    from tui.cli.commands.journal import change_line
    from tui.cli.documents.journal_documents import JournalEntryField
    from tui.cli.shared.output import json_text
    from tui.cli.shared.say import printable
    from tui.screens.keys import first_keys
    from tui.session import paths
    from tui.session.blocks.editor import load_words, save_words
    from tui.session.connect.identify import DriveIdentity
    from tui.session.journal import Journal
    from tui.session.journal_reading import completed, read_journal, selected
    from tui.session.settings.editor import load_marks, save_marks
    from tui.session.settings.restore import Mark
    from tui.session.starts.record import offer
    from tui.session.starts.starts import Starts
    from tui.session.teaching.teacher import keep_taught, load_taught

    no_commands("".join(printable(line, "utf-8") for line in paths.recent_lines()))
    paths.remember_line("sim:atv71")
    paths.address_text("tcp:x:502")
    paths.remember_addresses("tcp:x:502", "1")
    save_marks("atv71", load_marks("atv71").edited(["ACC"]))
    session = _Session()
    words = load_words(session)  # type: ignore[arg-type]
    save_words(session, words)  # type: ignore[arg-type]
    first_keys.was_tried()
    first_keys.remember()
    no_commands(printable(Mark(folder / "restore-tcp-x-502-1-atv71.json").interrupted, "utf-8"))
    try:
        entries = [e for e in read_journal(Journal().files) if isinstance(e, Entry)]
    except OSError:
        entries = []
    for entry in selected(completed(entries), device=1, lines=["tcp:x:502"]):
        no_commands(printable(change_line(entry), "utf-8"))
        no_commands(json_text(JournalEntryField(**asdict(entry))))
    for found in Starts().all_found("tcp:x:502"):
        offer(found, DriveIdentity(1, "", "", "", "", None, ()), True)
    try:
        keep_taught(taught, load_taught(taught))
    except TOLD as error:
        no_commands(printable(str(error), "utf-8"))


class _Session:
    """As much of a session as keeps user words."""

    line_text, device = "tcp:x:502", 1

    @property
    def profile(self) -> Profile:
        """The drive's."""
        return library.load("atv71")


# Replies


def _requests(chance: random.Random) -> Request:
    return chance.choice(
        (
            Read(1, 3201, chance.choice((1, 2, 20))),
            ReadWrite(1, 3201, 4, 8501, (0,)),
            WriteOne(1, 8501, 15),
            WriteMany(1, 8501, (15, 300)),
            Diagnose(1, 0, 0xA537),
            Identify(1),
        )
    )


def _answer(request: Request, chance: random.Random) -> bytes:
    pdu = request.pdu()
    match request:
        case Read(count=count) | ReadWrite(count=count):
            return bytes([pdu[0], 2 * count]) + chance.randbytes(2 * count)
        case Identify():
            texts = (b"Maker\x1b[2J", b"ATV71HU15M3", b"0201\x07", b"\x9b\xff\0")
            objects = b"".join(
                bytes([number, len(text)]) + text for number, text in enumerate(texts)
            )
            return bytes([43, 14, 1, 1, 0, 0, len(texts)]) + objects
        case _:
            return pdu[:5]


def reply_case(chance: random.Random, folder: Path) -> None:
    """A reply with wounds, the checksum right or not, among other bytes: refused or understood."""
    request = _requests(chance)
    pdu = bytearray(_answer(request, chance))
    for _ in range(chance.randrange(4)):
        at = chance.randrange(len(pdu))
        pdu[at : at + chance.randrange(3)] = chance.randbytes(chance.randrange(3))
        pdu = pdu or bytearray(b"\3")
    frame = sealed(bytes([1]) + bytes(pdu))
    if chance.random() < 0.3:
        frame = mutated(frame, chance)[:9000]
    data = chance.choice((b"", chance.randbytes(5), sealed(b"\1" + request.pdu()))) + frame
    exchange = RtuExchange(sealed(b"\1" + request.pdu()), request.expectation())
    result = None
    while data and result is None:
        lump = chance.randrange(1, len(data) + 1)
        result, data = exchange.feed(data[:lump]), data[lump:]
        result = result or exchange.silent()
    result = result or exchange.expired()
    if result.pdu and not result.exception:
        _understood(request, result.pdu)


def _understood(request: Request, pdu: bytes) -> None:
    from tui.bus.model import IdentificationObjects
    from tui.session.connect.identify import identity_from

    match request:
        case Identify():
            reported = Objects().with_more(pdu)
            identity = identity_from(
                1, IdentificationObjects(reported.conformity, reported.objects)
            )
            # on any output
            no_commands(f"{identity.vendor}{identity.reference}{identity.version}{identity.name}")
        case Diagnose():
            diagnostic_of(pdu)
        case _:
            assert all(0 <= word <= 0xFFFF for word in request.words(pdu))


CASES: Mapping[str, Case] = {
    "profiles": profile_case,
    "sets": set_case,
    "blocks": block_case,
    "state": state_case,
    "replies": reply_case,
}
