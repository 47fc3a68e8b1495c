"""Blocks of a drive, triggers of a recording and bundles, as text.

`recorded_blocks.txt` has a section for each subject; each entry has the case and its results.
"""

from __future__ import annotations

import asyncio
import io
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from itertools import product
from pathlib import Path

import pytest

import tui
from tests.recorded import result, sections
from tui.bus.errors import LineError
from tui.bus.fake import FakeLine
from tui.bus.fake_device import FakeDevice
from tui.drive.blocks.assignment import Assignment, factory, slot_target
from tui.drive.blocks.picking import pick
from tui.drive.errors import DriveError
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block
from tui.session.blocks import outputs
from tui.session.blocks.mapping import BlockView, Mapper
from tui.session.blocks.proposals import (
    Proposals,
    monitoring_stretches,
    useful_codes,
    watched_first,
)
from tui.session.bundle.parts import Part, PartFile, PartResult
from tui.session.bundle.redaction import Names, Redaction
from tui.session.bundle.work import archive
from tui.session.drive import DriveSession
from tui.session.recording.triggers import CycleSeen, TriggeredRows, parse_trigger

from .test_record import row_of

TEXTS = Path(__file__).parent / "recorded_blocks.txt"
CODES = {
    "atv71": (("ETA", "RFR", "LCR", "ULN", "ACC"), ("CMD", "LFRD", "HSP", "ACC")),
    "atv21": (("FD01", "FD00", "FE03", "FC91"), ("FA00", "FA01")),
}


class BlockDevice(FakeDevice):
    """A drive whose blocks return the words of the parameters in their slots."""

    def __init__(self, profile: Profile) -> None:
        words = {p.address + part: 5 for p in profile.parameters for part in (0, 1)}
        super().__init__(1, words)
        self.profile = profile
        self.moving: dict[int, int] = {}
        """Registers whose value grows with each read, by how much."""
        self.effective: dict[str, int] = {}
        """Slots that return another parameter than they hold, until the next reset."""
        self.refused = False
        self.changing = ""
        """A slot that another program changes with each read of the block."""

    def held(self, address: int, count: int) -> tuple[int, ...]:
        for block in self.profile.data.blocks:
            span = range(block.address, block.address + block.max_words)
            if address in span and address + count - 1 in span:
                if self.refused:
                    break
                return tuple(self._word(block, at - block.address)
                             for at in range(address, address + count))  # fmt: skip
        else:
            found = super().held(address, count)
            for at in range(address, address + count):
                self.words[at] = self.words[at] + self.moving.get(at, 0)
            return found
        self.words = {at: word for at, word in self.words.items() if at not in span}
        return super().held(address, count)

    def _word(self, block: Block, place: int) -> int:
        slot = block.slots[place]
        raw = self.effective.get(slot, self.words[self.profile[slot].address])
        if slot == self.changing:
            self.words[self.profile[slot].address] += 1
        target = slot_target(self.profile, block, raw)
        return 0x8000 if target is None else self.words[target.address]


def planned(profile: Profile, direction: str, codes: Sequence[str]) -> Assignment:
    """A block with these parameters in its slots."""
    block = next(block for block in profile.data.blocks if block.direction == direction)
    plan = Assignment(block, (0,) * len(block.slots))
    for place, code in enumerate(codes):
        plan = pick(profile, plan, place, code)
    return plan


def device_with(profile: Profile, *plans: Assignment) -> BlockDevice:
    device = BlockDevice(profile)
    for at, entry in enumerate(profile.parameters):
        device.words[entry.address] = at % 50 + 1
    for plan in plans:
        for slot, raw in plan.slots.items():
            device.words[profile[slot].address] = raw
    return device


def view_texts(view: BlockView) -> Iterator[str]:
    yield f"  {view.trouble!r} {view.is_doubtful} {view.is_unproved} {view.plan and view.plan.raws}"
    for slot in view.slots:
        code = slot.parameter.code if slot.parameter else None
        compared = f"{slot.verdict} {slot.force} {slot.returned_code}"
        read = f"{slot.word} {slot.text} {slot.direct_text}"
        yield f"  {slot.code} {slot.raw} {code} {read} {compared}"


def mappings() -> Iterator[str]:
    """Slots of blocks with their values, read from drives of several kinds."""
    for name, direction in product(CODES, ("read", "write")):
        yield from mapping_texts(name, direction)


def mapping_texts(name: str, direction: str) -> Iterator[str]:
    profile = load(name)
    plan = planned(profile, direction, CODES[name][direction == "write"])
    block = plan.block
    values = [slot_target(profile, block, raw) for raw in plan.raws]
    addresses = [entry.address for entry in values if entry is not None]
    first, second = block.slots[:2]
    cases: Mapping[str, Callable[[BlockDevice], object]] = {
        "as held": lambda device: None,
        "one moves": lambda device: device.moving.update({addresses[1]: 1}),
        "all move": lambda device: device.moving.update(dict.fromkeys(addresses, 3)),
        "another one": lambda device: device.effective.update({first: plan.slots[second]}),
        "nothing": lambda device: device.effective.update({second: 9999}),
        "refused": lambda device: setattr(device, "refused", True),
        "slot lost": lambda device: device.words.pop(profile[second].address),
        "slot changes": lambda device: setattr(device, "changing", second),
        "unused": lambda device: device.words.update({profile[first].address: 0}),
        "all equal": lambda device: device.words.update(dict.fromkeys(addresses, 4)),
        "unknown word": lambda device: device.words.update({addresses[0]: 0x8000}),
    }
    for case, change in cases.items():
        for rounds, written, known in ((3, plan.slots, {}), (1, {}, plan.slots)):
            device = device_with(profile, plan)
            change(device)
            line = FakeLine({1: {}})
            line.devices[1] = device
            mapper = Mapper(DriveSession(line, 1, profile), lambda held=known: held)  # type: ignore[misc]
            mapper.written = dict(written)
            yield f"{name} {direction} {case} {rounds} {len(written)} {len(known)}"
            try:
                yield from view_texts(asyncio.run(mapper.look(block, rounds=rounds)))
            except (LineError, DriveError) as error:
                yield f"  {error}"
            yield f"  {len(line.requests)} requests"


def written_outputs() -> Iterator[str]:
    """Values for outputs as a person types them, with frames and consequences."""
    typed = ("LFRD=1500 ACC=5.0", "acc=5,0", "CMD=6", "HSP=40", "LFRD=1", "ACC", "ACC=x", "RFR=1",
             "", "gone=1", "FA01=20", "FA00=16#0400 FA01=3,5", "FA00=0")  # fmt: skip
    for name in CODES:
        profile = load(name)
        inputs, plan = (planned(profile, direction, codes) for direction, codes in
                        zip(("read", "write"), CODES[name], strict=True))  # fmt: skip
        raws = {entry.code: at % 50 + 1 for at, entry in enumerate(profile.parameters)}
        raws |= {"INR": 1}
        for text, read, known in product(typed, (inputs, None), (raws, {})):
            found = result(outputs.intended, profile, 3, plan, read, known, (), text)
            yield f"{name} {text} {read is not None} {len(known)}: {found}"
        yield outputs.example(profile, plan, raws, ())
        yield outputs.values_text(profile, dict.fromkeys(CODES[name][0], 7), raws, ())
        yield f"{list(outputs.output_codes(profile, plan))}"
        for waits in ({}, plan.slots, dict(list(plan.slots.items())[1:2])):
            yield result(outputs.refuse_pending, plan, waits)


def proposals() -> Iterator[str]:
    """Proposals for the blocks of a drive: each step, its changes, problems and savings."""
    for name in ("atv71", "atv21", "powerdrive"):
        yield from proposal_texts(name)


def proposal_texts(name: str) -> Iterator[str]:
    profile = load(name)
    line, busy = FakeLine({1: {}}), [False]
    session = DriveSession(line, 1, profile)
    made = Proposals(session, lambda: busy[0])
    yield f"{name} {[block.id for block in made.blocks]} {watched_first(profile)}"
    yield f"  {monitoring_stretches(session)[:4]}"
    yield f"  {result(made.best)} {made.saving()} {made.count}"
    blocks = made.blocks
    for block in blocks:
        yield f"  {result(made.move, block, 0, 1)} {made.proposed(block)}"
        for at, slot in enumerate(block.slots):
            session.image.confirm(slot, (0, 3201, 3202, 1)[at % 4], 1.0)
    if not blocks:
        return
    read, write = blocks[0], blocks[-1]
    code = CODES[name][0][2]
    steps: Sequence[tuple[str, Callable[[], object]]] = (
        ("pick", lambda: made.pick(read, 3, code)), ("move", lambda: made.move(read, 3, -1)),
        ("same", lambda: made.pick(read, 3, code)), ("clear", lambda: made.clear(read, 0)),
        ("unknown", lambda: made.pick(read, 0, "gone")), ("best", made.best),
        ("factory", lambda: made.factory(write)),
        ("back", lambda: made.propose(made.today(read) or factory(profile, read))),
        ("busy", lambda: busy.append(busy.pop(0) or True)),
        ("refused", lambda: made.clear(read, 1)), ("dropped", made.drop),
    )  # fmt: skip
    for step, call in steps:
        yield f"  {step}: {result(call)} {made.count} {sorted(made.plans)} {made.seen}"
        for block in blocks:
            yield f"    {made.changes(block)}"
            yield f"    {[problem.text for problem in made.problems(block)]}"
            yield f"    {useful_codes(made, block)[:5]}"
        yield f"    {made.saving()}"


# Triggers


def triggers() -> Iterator[str]:
    """Triggers as typed, what they report, and the rows around them."""
    at = datetime(2026, 11, 26, 8, 59, 58).timestamp()
    looks = [
        CycleSeen(at + number * 0.5, {"LCR": level, "RFR": 10 - level}, fault, command)
        for number, (level, fault, command) in enumerate((
            (8.0, "", 6), (9.0, "OCF", None), (9.5, "OCF", 6), (8.5, "", 15), (9.1, "SLF", 15),
            (7.9, "SLF", 7), (9.01, "", None), (-3.0, "", 7),
        ))
    ]  # fmt: skip
    looks.insert(3, looks[3]._replace(numbers={}))
    typed = ("fault", " Command ", "9:00", "09:00:01", "08:59:59", "LCR>9", "LCR > 9 , 8", "RFR<1",
             "RFR<1,2.5", "LCR>-5", "lcr>9", "LCR>9,10", "RFR<5,4", "LCR>1.2.3", "LCR>9,x", "24:00",
             "LCR", "", "LCR=9", "a b>1")  # fmt: skip
    for text in typed:
        yield f"{text!r}: {result(parse_trigger, text)}"
        with suppress(DriveError):
            trigger = parse_trigger(text)
            yield f"  {[trigger.fired(look) for look in looks]}"
    for before, after, always in product((0.0, 1.0, 2.5), (0.0, 1.0, 2.5), (False, True)):
        rows = TriggeredRows(before, after, always)
        passed = [
            len(rows.take(second / 2, [row_of(second)] * (second % 3), fired=second in (7, 9, 20)))
            for second in range(26)
        ]
        yield f"{before} {after} {always}: {passed}"


# Bundles


async def nothing() -> PartFile:
    raise AssertionError


def archives() -> Iterator[str]:
    """Bundles of parts that were collected or not: their files, as a person reads them."""
    parts = (
        PartResult(Part("drive-3/why.json", "Why. " * 30, nothing), PartFile({"b": [1, "jdoe é"]})),
        PartResult(Part("profiles/check.json", "Two\nlines.", nothing),
                   PartFile(["jdoe"], "Half.", {"jdoe.toml": "by = 'jdoe'", "a.toml": b"\xff"})),
        PartResult(Part("frames.raw.pcapng", "Frames:\ntshark " + "-o x " * 30, nothing),
                   PartFile(b"frames of jdoe", "9 frames by jdoe, " * 9)),
        PartResult(Part("log.txt", "The log.", nothing), PartFile("token=abcd1234 of jdoe")),
        PartResult(Part("screens", "Screens.", nothing), None, "jdoe has none. " * 9),
        PartResult(Part("messages.txt", "Messages.", nothing), None, "password: hunter22"),
    )  # fmt: skip
    for chosen in (parts, parts[:1], parts[4:]):
        made = archive(chosen, Redaction(Names(users=frozenset({"jdoe"}))), "stem")
        yield f"{made.files} {made.missing} {made.omitted}"
        with zipfile.ZipFile(io.BytesIO(made.data)) as opened:
            for info in opened.infolist():
                text = opened.read(info).decode("utf-8", "backslashreplace")
                text = re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d [+-]\d{4}", "TIME", text)
                yield f"{info.filename} {info.external_attr >> 16:o} {info.compress_type}"
                yield text.replace(tui.__version__, "VERSION")


SECTIONS = (mappings, written_outputs, proposals, triggers, archives)


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_blocks_triggers_and_bundles_are_the_recorded_ones(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
