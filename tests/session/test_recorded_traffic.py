"""Traffic on lines with other masters, decoded and summarized, as recorded text.

`recorded_traffic.txt` has a section for each subject. A scene has its frames, the texts of its
exchanges, all counts of the line and of each drive, and the summary that a person reads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from itertools import combinations_with_replacement, product
from pathlib import Path

import pytest
from msgspec import structs

from tests.drive.test_whole_values import whole
from tests.recorded import sections, short
from tests.session.test_listening import CHARACTER, PROFILES, SILENCE, named
from tests.wire.test_observed import (
    BOTH,
    BOTH_REPLY,
    COMMAND,
    IDENTIFY,
    IDENTITY,
    READ,
    REFUSED,
    UNKNOWN,
    WORDS,
    reply_words,
    write_one,
)
from tui.bus.limits import STANDARD_EXCEPTIONS
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import WireTiming
from tui.session.listening.families import Families
from tui.session.listening.listener import DriveTally, LineListener
from tui.session.listening.summary import (
    Feeding,
    exception_meaning,
    feeding,
    feeding_text,
    summary_lines,
    summary_of,
)
from tui.session.listening.telling import exchange_text, function_name, requested_names
from tui.session.listening.words import identity_objects, names_of_words, spans_of
from tui.wire.frames import frame, read_frame, write_frame
from tui.wire.observed.pairing import ObservedAnswer, ObservedExchange
from tui.wire.observed.splitting import ObservedFrame

TEXTS = Path(__file__).parent / "recorded_traffic.txt"
TIMING = WireTiming(CHARACTER, SILENCE, 0.005)


def hexed(text: str, device: int = 2) -> bytes:
    """A frame by the hexadecimal digits of its function and data."""
    return frame(device, bytes.fromhex(text))


def own(address: int, *words: int, device: int = 2) -> list[bytes]:
    """A read with its reply."""
    return [read_frame(device, address, len(words)), reply_words(device, *words)]


ATV = library.load("atv71")
TTO = ATV["TTO"].address
Pause = float
"""Seconds without a byte, in a scene."""
SCENES: dict[str, tuple[Families, Sequence[bytes | Pause]]] = {
    "nothing": (named(), [5.0]),
    "one request": (named(), [READ, 0.4]),
    "slow polls": (
        named("atv71", "atv71"), [*own(3201, 7), 2.0, *own(3201, 7), 2.4, *own(3201, 8)],
    ),
    "reads, writes": (
        named("atv31", "atv71"),
        [READ, WORDS, COMMAND, COMMAND, write_frame(2, 8501, [6, 425]), hexed("1021350002"), BOTH,
         BOTH_REPLY, write_one(2, 9001, 30), write_one(2, 9001, 30), write_one(2, 7, 30),
         write_one(2, 7, 31), 0.1, COMMAND, COMMAND],
    ),
    "coils and others": (
        named(),
        [hexed("0100050003"), hexed("010105"), hexed("0200050003"), hexed("020102"),
         hexed("0400050002"), hexed("04040001ffff"), hexed("050007ff00"), hexed("050007ff00"),
         hexed("0500070000"), hexed("0500070000"), hexed("0f0003000a02cd01"), hexed("0f0003000a"),
         hexed("0f0003000a01cd"), 4.0, hexed("07"), hexed("0712"), hexed("0800001234"),
         hexed("0800001234"), hexed("11"), hexed("110201ff"), hexed("160004f2000025"),
         hexed("160004f2000025"), UNKNOWN, 0.1, UNKNOWN, 4.0],
    ),
    "identity": (
        named(),
        [IDENTIFY, IDENTITY, *own(3201, 7), IDENTIFY,
         hexed("2b0e0101000003000153010541545637310203313033"), hexed("2b0e0101"), IDENTIFY,
         hexed("2b0e010100000200015300014e"), IDENTIFY, hexed("ab01"), IDENTIFY, 4.0],
    ),
    "no answers": (
        named("atv71", "atv71"),
        [READ, WORDS, READ, 3.5, READ, 3.5, READ, b"\x07\x07", 3.5, READ, REFUSED, READ, REFUSED,
         READ, hexed("8304"), READ, hexed("8363"), READ, WORDS, WORDS, READ, WORDS, WORDS,
         hexed("0302ffff", 9), read_frame(8, 60, 2), 3.5, read_frame(8, 60, 2), 3.5,
         read_frame(7, 60, 2), hexed("8302", 7), read_frame(6, 60, 1), b"\x09\x09\x09", 3.5],
    ),
    "broadcasts": (
        named("atv71", "atv71"),
        [frame(0, bytes.fromhex("0621350000")), 0.1, frame(0, bytes.fromhex("0621350000")), 0.1],
    ),
    "two masters": (
        named(), [READ + read_frame(3, 3201, 1), reply_words(3, 7), READ, 0.0095, READ, 3.5],
    ),
    "noise": (
        named(), [b"\xff\x00\xff", 0.1, READ, WORDS, b"\x55", 0.1, READ, WORDS[:4], WORDS[4:]],
    ),
    "only noise": (named(), [b"\xff", 0.1]),
    "two bytes of noise": (named(), [b"\xff\xfe", 0.1]),
    "at once": (named(), [READ + WORDS, READ + WORDS, READ + WORDS]),
    "timeouts": (
        named("atv71", "atv71", "atv312", "atv31", "powerdrive", "atv21", "varmeca"),
        [COMMAND, COMMAND, *own(TTO, 30), *own(3201, 7), 3.5, *own(3201, 7),
         *own(3201, 7, device=1), *own(3201, 7, device=3), *own(3201, 7, device=4),
         *own(1, 7, device=5), *own(1, 7, device=6), *own(1, 7, device=7)],
    ),
    "shorter": (
        named("atv71", "atv71", "atv71"),
        [*own(3204, 1)] + 3 * [*own(3201, 1), *own(3202, 1), *own(3204, 1), *own(3201, 1, device=3)]
        + [*own(60000, 1, device=1), *own(60000, 1, device=1)] * 2,
    ),
    "guesses": (
        named(),
        [*own(3201, 1, 2), *own(5, 1, 2, 3, 4, device=3), read_frame(3, 64001, 1), hexed("8302", 3),
         read_frame(3, 3201, 1), hexed("8302", 3), *own(0xFD00, 1, device=4),
         read_frame(4, 0xFD01, 1), hexed("8301", 4), *own(3201, *range(40), device=5),
         hexed("0404bb0001", 6), hexed("04020001", 6)],
    ),
    "whole": (
        Families(PROFILES, {None: whole()}, {2: "atv31"}),
        [*own(100, 0x0107, 425, 7), *own(100, 1), *own(100, 1), *own(101, 1), *own(101, 1),
         *own(110, 1), write_one(2, 111, 15), write_one(2, 111, 15), 4.0],
    ),
    "memory": (
        Families(PROFILES, {7: ATV}, {2: "atv312", 3: "gone"}),
        [READ, WORDS, *own(3201, 7, device=3)],
    ),
}  # fmt: skip


def traffic() -> Iterator[str]:
    """Each scene: frames, exchanges, counts, and the summary."""
    for name, (families, steps) in SCENES.items():
        for character in (CHARACTER, 0.0) if name in ("reads, writes", "noise") else (CHARACTER,):
            yield f"-- {name}, {character:.5f}"
            yield from scene(families, steps, character)


def scene(families: Families, steps: Sequence[bytes | Pause], character: float) -> Iterator[str]:
    frames: list[str] = []

    def heard(found: ObservedFrame, request: bool | None) -> None:
        kind = "noise" if request is None else "request" if request else "reply"
        frames.append(f"{found.begun:.4f} {found.data.hex()} {kind}")

    listener = LineListener(families, 0.5, character=character, silence=SILENCE, on_frame=heard)
    now, exchanges = 0.5, []
    for step in steps:
        now += 0.02 if isinstance(step, bytes) else step
        done = listener.take(step, now) if isinstance(step, bytes) else listener.idle(now)
        exchanges += done
    exchanges += listener.end(now + 0.3)
    yield from frames
    for each in exchanges:
        values = [(value.address, value.raw, value.written) for value in each.values]
        how = f"{each.family.how} {each.family.profile.id}" if each.family else "no family"
        yield f"{exchange_text(each, families)}| {requested_names(each)} {values} {how}"
    found = summary_of(listener, now, TIMING)
    line = (f"{item.name} {getattr(found.tally, item.name)}" for item in fields(found.tally)[:-1])
    yield f"{', '.join(line)}, pause {listener.pause:.4f}; load {found.load or 0:.4f}"
    for drive in found.drives:
        yield f"{drive.tally.device}: {counts(drive.tally)}"
    yield from summary_lines(found)


def counts(tally: DriveTally) -> str:
    """The counts of a drive, in short."""
    times = f"{tally.first:.3f} {tally.last:.3f} {tally.longest_pause:.3f}"
    reads = [
        (span.function, span.address, span.count, each.times, each.every and round(each.every, 3))
        for span, each in tally.reads.items()
    ]
    writes = [(code, each.times, each.raw, each.commands) for code, each in tally.writes.items()]
    return (
        f"{tally.requests} {dict(tally.answers)} {dict(tally.exceptions)} {reads} {writes}"
        f" {tally.raws} {times}"
    )


def words() -> Iterator[str]:
    """Requests and replies in parts, whole and cut short."""
    for text in ("0300050002", "0600050002", "10000500020400010002", "1000050002040001",
                 "17000100020005000204", "170001000200050001020007", "050005ff00", "0500050001",
                 "0f0005000a020301", "0f0005000a0103", "0f00050009020301", "0100050001", "07",
                 "03000500"):  # fmt: skip
        yield f"{text}: {short(spans_of(bytes.fromhex(text)))}"
        for span in spans_of(bytes.fromhex(text)):
            yield f"  {names_of_words(span, ATV)} {names_of_words(span, None)}"
    ask = bytes.fromhex("2b0e0100")
    for text in ("2b0e0102000001000141", "2b0e0102000002000141010142", "2b0e0102000002000141000142",
                 "2b0e0102000002000141000141", "2b0e01020000020001410101", "2b0e010200000100",
                 "2b0e01020000020001410a", "2b0e010200000a000141", "2b0e01020000",
                 "2b0e0102000000"):  # fmt: skip
        answers: tuple[tuple[ObservedAnswer, int], ...] = (("ok", 43), ("none", 43), ("ok", 3))
        for answer, function in answers:
            heard = ObservedExchange(0.0, 2, function, answer, ask, bytes.fromhex(text))
            yield f"{text} {answer} {function}: {identity_objects(heard)}"
    yield f"{[function_name(function) for function in range(45)]}"
    for code in (*STANDARD_EXCEPTIONS, 0, 99):
        yield f"{code}: {exception_meaning(code, None)} {exception_meaning(code, whole())}"


def answered(text: str, reply: str = "", device: int = 2) -> ObservedExchange:
    """A request that a drive answered, with an exception if there is one."""
    request, answer = bytes.fromhex(text), bytes.fromhex(reply)
    kind: ObservedAnswer = "exception" if answer[:1] > b"\x80" else "ok"
    return ObservedExchange(0.0, device, request[0], kind, request, answer)


def guesses() -> Iterator[str]:
    """The likely family after one fact, and after each pair of facts."""
    facts = {
        "state": answered("030c810001"), "four words": answered("030c810004"),
        "thirty words": answered("030c81001e"), "gap": answered("03ea600002"),
        "block": answered("0331c50003"), "behind block": answered("0331cd0001"),
        "of atv31": answered("0314790001"), "of atv71": answered("0321390001"),
        "no word": answered("0314790001", "8302"), "no words": answered("0314790002", "8302"),
        "not now": answered("0314790001", "8304"), "no block": answered("0331c50001", "8302"),
        "no function": answered("17000100020005000102000a", "9701"),
        "function": answered("170c8100012135000102000a"), "write": answered("0621350006"),
        "coils": answered("0100010002"), "of atv21": answered("03fd000001"),
        "no function of others": answered("0800000000", "8801"),
    }  # fmt: skip
    for first, second in combinations_with_replacement(facts, 2):
        families = Families(PROFILES)
        families.note(facts[first])
        before = families.family(2)
        families.note(facts[second])
        found = families.family(2)
        if first == second or found != before:
            name = found and (found.how, found.profile.id, *found.others)
            yield f"{first}, {second}: {name}"


def timeouts() -> Iterator[str]:
    """The margin of a timeout, by its rules, the values that were read, and the pauses."""
    profile = whole()
    assert profile.data.communication_fault is not None
    rules = profile.data.communication_fault
    others = {
        "whole": rules, "none": None,
        **{f"{changed}": structs.replace(rules, **changed) for changed in (
            {"timeout": ""}, {"other_timeouts": ["TRCT", "GONE"]}, {"needs_write": True},
            {"timeout": "GONE"},
        )},
    }  # fmt: skip
    yield f"{feeding(profile, DriveTally(2, 0.0), 20.0)}"
    for (name, changed), raws in product(
        others.items(), ({}, {"TOUT": 0}, {"TOUT": 25}, {"TOUT": 90, "TRCT": 3})
    ):
        family = Profile(structs.replace(profile.data, communication_fault=changed))
        tally = DriveTally(2, 0.0, raws=raws, fed=10.0, longest_pause=1.5)
        for now in (10.5, 12.5, 20.0):
            found = feeding(family, tally, now)
            text = f"{short(found)} {found.fed} {feeding_text(found)}" if found else "nothing"
            yield f"{name} {raws} {now}: {text}"
    off = Feeding("TOUT", None, "factory", True, 1.0)
    yield f"{[feeding_text(each) for each in (off, replace(off, known='heard'))]}"
    yield feeding_text(replace(off, seconds=1.0))


SECTIONS = (traffic, words, guesses, timeouts)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_traffic_of_other_masters_gives_what_is_recorded(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
