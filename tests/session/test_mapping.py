"""Blocks and scanner of simulated drives over a real line: read, compared, written, exchanged."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.blocks import block_of
from tests.programs import rtu_tcp
from tests.session.sets_bench import Bench, bench
from tui.bus.errors import DeviceException, LineError, LineLost, NoAnswer, RequestRefused
from tui.bus.line import Reply
from tui.drive.blocks.assignment import Assignment, empty, factory
from tui.drive.blocks.picking import pick
from tui.drive.blocks.user_words import COUNT, UserWord
from tui.drive.blocks.wire_cost import block_request, span
from tui.drive.profile import library
from tui.drive.profile.schema import Block
from tui.session.blocks.editor import load_words, read_words, save_words
from tui.session.blocks.mapping import Force, Mapper, wire_timing
from tui.session.blocks.write import AssignmentRefused, write_assignment
from tui.session.connect.open_line import open_line
from tui.session.drive import DriveSession
from tui.session.read.proof import SlotMatch
from tui.session.read.reader import Reader
from tui.simulator import DriveSpec, LineTiming, Simulation

NO_WORDS = (UserWord(),) * COUNT
EXAMPLE_IN = ["ETA", "RFRD", "LCR", "OTR", "ULN", "THD", "THR", "LFT"]
EXAMPLE_OUT = ["CMD", "LFRD", "HSP", "LSP", "ACC", "DEC"]
READ_BLOCK = {"F875": 1, "F876": 2, "F877": 3, "F878": 4, "F879": 5}


def block(here: Bench, direction: str) -> Block:
    return block_of(here.profile, direction)


def plan_of(here: Bench, direction: str, codes: list[str]) -> Assignment:
    plan = empty(block(here, direction))
    for place, code in enumerate(codes):
        plan = pick(here.profile, plan, place, code)
    return plan


def sets_of(plan: Assignment) -> dict[str, int]:
    return plan.slots


def sent(here: Bench, function: int) -> list[str]:
    """The bodies of all requests of a function so far, without checksum."""
    frames = [f.data for f in here.session.line.trace if f.direction == "out"]
    return [data[:-2].hex() for data in frames if data[1] == function]


async def write(here: Bench, plan: Assignment, **how: object) -> str:
    how.setdefault("permit", here.permit())
    done = await write_assignment(here.session, here.journal, plan, **how)  # type: ignore[arg-type]
    return done.text


def disarmed(here: Bench) -> None:
    here.session.arming.disarm("Disarmed: no key pressed for 60 s.")


def stopped(here: Bench) -> None:
    here.session.work.stop("the stop key")


# Looking


async def test_factory_scanner_is_compared() -> None:
    with bench("atv71") as here:
        view = await Mapper(here.session).look(block(here, "read"))
        assert view.plan == factory(here.profile, view.block)
        assert [s.parameter.code for s in view.slots if s.parameter] == ["ETA", "RFRD"]
        assert {s.verdict for s in view.slots[:2]} == {SlotMatch.SAME}
        assert {s.verdict for s in view.slots[2:]} == {SlotMatch.UNUSED}
        assert view.slots[0].text == view.slots[0].direct_text
        assert view.slots[0].force is Force.ACTIVE
        outputs = await Mapper(here.session).look(block(here, "write"))
        assert [s.parameter.code for s in outputs.slots if s.parameter] == ["CMD", "LFRD"]


async def test_values_of_a_running_motor_are_equal_or_moving() -> None:
    with bench("atv71", run_hz=35.0) as here:
        for slot, raw in plan_of(here, "read", EXAMPLE_IN).slots.items():
            here.drive.set(slot, raw)
        view = await Mapper(here.session).verify(block(here, "read"))
        assert {s.verdict for s in view.slots} <= {SlotMatch.SAME, SlotMatch.MOVING}
        assert view.slots[7].verdict is SlotMatch.SAME
        assert all(s.text != "-----" for s in view.slots)


async def test_unknown_address_has_no_value() -> None:
    with bench("atv71", sets={"NMA3": 3199}) as here:
        view = await Mapper(here.session).look(block(here, "read"))
        assert view.slots[2].verdict is SlotMatch.NONE
        assert (view.slots[2].parameter, view.slots[2].text) == (None, "-----")
        assert view.slots[1].verdict is SlotMatch.SAME


async def test_slot_with_another_value_differs() -> None:
    with bench("atv71", sets={"NMA1": 9001, "NMA2": 9002, "ACC": 37, "DEC": 59}) as here:
        line = here.session.line
        honest = line.read

        async def swapped(device: int, address: int, count: int = 1, **how: object) -> Reply:
            reply = await honest(device, address, count, **how)  # type: ignore[arg-type]
            if address != block(here, "read").address:
                return reply
            first, second, *rest = reply.words
            return Reply((second, first, *rest), reply.time)

        line.read = swapped  # type: ignore[method-assign]
        view = await Mapper(here.session).verify(block(here, "read"))
        assert [s.verdict for s in view.slots[:2]] == [SlotMatch.DIFFERS, SlotMatch.DIFFERS]


async def test_scanner_changed_between_reads_never_mixes_values() -> None:
    words = {"ACC": 37, "DEC": 59, "HSP": 523, "LSP": 41}
    with bench("atv71", sets=words) as here:
        codes = list(words)
        orders = itertools.cycle(itertools.permutations(codes))
        line, honest = here.session.line, here.session.line.read
        changes = itertools.count()

        def change() -> None:
            for slot, raw in plan_of(here, "read", list(next(orders))).slots.items():
                here.drive.set(slot, raw)

        async def read(device: int, address: int, count: int = 1, **how: object) -> Reply:
            # another master writes the slots at every second read, wherever that is
            if next(changes) % 3:
                change()
            return await honest(device, address, count, **how)  # type: ignore[arg-type]

        change()
        line.read = read  # type: ignore[method-assign]
        mapper, verdicts = Mapper(here.session), set()
        for _ in range(25):
            view = await mapper.look(block(here, "read"))
            for slot in view.slots:
                verdicts.add(slot.verdict)
                if slot.word is not None and slot.parameter is not None:
                    assert slot.word == words[slot.parameter.code]
        assert SlotMatch.CHANGED in verdicts


async def test_drive_without_blocks_has_nothing_to_compare() -> None:
    with bench("atv312") as here:
        assert here.profile.data.blocks == []


# The indirect block of the Altivar 21


async def test_block_is_configured_then_pending_then_active() -> None:
    with bench("atv21", sets=READ_BLOCK, run_hz=35.0) as here:
        mapper, read = Mapper(here.session), block(here, "read")
        view = await mapper.verify(read)
        assert [s.force for s in view.slots[:4]] == [Force.ACTIVE] * 4
        assert {s.verdict for s in view.slots} <= {SlotMatch.SAME, SlotMatch.MOVING}
        here.drive.set("F875", 2)
        here.drive.set("F876", 1)
        # words in the drive are not yet those of the block
        await here.session.line.write(1, here.profile["F877"].address, [4])
        await here.session.line.write(1, here.profile["F878"].address, [3])
        view = await mapper.verify(read)
        assert [s.force for s in view.slots[2:4]] == [Force.PENDING] * 2
        assert [s.returned_code for s in view.slots[2:4]] == ["FE03", "FE05"]
        # two values that move may be alike for once
        assert SlotMatch.SAME not in {s.verdict for s in view.slots[2:4]}
        here.drive.power_cycle()
        await asyncio.sleep(2.5)
        view = await mapper.verify(read)
        assert Force.PENDING not in {s.force for s in view.slots}
        assert [s.parameter.code for s in view.slots[2:4] if s.parameter] == ["FE05", "FE03"]


async def test_one_comparison_does_not_confirm_but_a_monitor_may() -> None:
    with bench("atv21", sets=READ_BLOCK, run_hz=35.0) as here:
        read = block(here, "read")
        view = await Mapper(here.session).look(read)
        assert {s.force for s in view.slots} == {Force.UNPROVED}
        view = await Mapper(here.session, lambda: {"F875": 1, "F876": 3}).look(read)
        assert [s.force for s in view.slots[:2]] == [Force.ACTIVE, Force.UNPROVED]


async def test_slots_changed_between_comparisons_are_not_confirmed() -> None:
    # at standstill, where all values are zero and cannot be distinguished
    with bench("atv21", sets=READ_BLOCK) as here:
        line, honest, reads = here.session.line, here.session.line.read, itertools.count()

        async def read(device: int, address: int, count: int = 1, **how: object) -> Reply:
            reply = await honest(device, address, count, **how)  # type: ignore[arg-type]
            if address == block(here, "read").address and next(reads) == 0:
                await line.write(1, here.profile["F877"].address, [4])
            return reply

        line.read = read  # type: ignore[method-assign]
        view = await Mapper(here.session).verify(block(here, "read"))
        assert view.slots[2].raw == 4
        assert view.slots[2].force is Force.UNPROVED


@pytest.mark.parametrize("between", [False, True], ids=["under way", "between two rounds"])
async def test_comparison_before_a_change_no_longer_applies(between: bool) -> None:
    codes = ["ACC", "DEC"]
    with bench("atv71", sets={"ACC": 37, "DEC": 59}) as here:
        line, honest, reads = here.session.line, here.session.line.read, itertools.count()

        def choose(codes: list[str]) -> None:
            for slot, raw in plan_of(here, "read", codes).slots.items():
                here.drive.set(slot, raw)

        async def read(device: int, address: int, count: int = 1, **how: object) -> Reply:
            reply = await honest(device, address, count, **how)  # type: ignore[arg-type]
            if address == watched and next(reads) == 1:
                choose(codes[::-1])
            return reply

        # with the second reply of the block, or of the slots when they are read after the first
        watched = here.profile["NMA1"].address if between else block(here, "read").address
        choose(codes)
        line.read = read  # type: ignore[method-assign]
        view = await Mapper(here.session).verify(block(here, "read"))
        assert [s.word for s in view.slots[:2]] == [59, 37]
        assert [s.verdict for s in view.slots[:2]] == [SlotMatch.SAME] * 2


async def test_written_slots_wait_for_reset_with_zero_values() -> None:
    with bench("atv21") as here:
        mapper, read = Mapper(here.session), block(here, "read")
        text = await write(here, plan_of(here, "read", ["FE03", "FD00"]))
        assert "after the drive's next reset" in text
        mapper.written = {"F875": 3, "F876": 2}
        view = await mapper.verify(read)
        assert [s.force for s in view.slots[:2]] == [Force.PENDING] * 2
        here.drive.power_cycle()
        mapper.note_reset()
        await asyncio.sleep(2.5)
        view = await mapper.verify(read)
        assert [s.force for s in view.slots[:2]] == [Force.UNPROVED] * 2


async def test_write_block_cannot_be_read() -> None:
    with bench("atv21", sets={"F870": 1, "F871": 3}) as here:
        view = await Mapper(here.session).look(block(here, "write"))
        assert "can only be written" in view.trouble
        assert [s.parameter.code for s in view.slots if s.parameter] == ["FA00", "FA01"]
        assert {s.force for s in view.slots} == {Force.UNPROVED}
        assert all(s.direct is not None for s in view.slots)


@pytest.mark.parametrize("count", [2, 5])
async def test_manual_reads_of_the_block_succeed(count: int) -> None:
    with bench("atv21", sets=READ_BLOCK) as here:
        read = plan_of(here, "read", ["FD01", "FD00", "FE03", "FE05", "FC91"][:count])
        stretch = span(read)
        assert stretch is not None
        reply = await here.session.line.read(1, *stretch)
        assert len(reply.words) == count
        assert sent(here, 3)[-1] == f"010318750{count:03x}"
        assert block_request(here.profile, 1, read, None)[:-2].hex() == sent(here, 3)[-1]
        assert reply.words[1] == here.drive.raw("FD00")


@pytest.mark.parametrize(("address", "count"), [(0x1876, 2), (0x1875, 6), (0x1874, 2), (0x1879, 5)])
async def test_invalid_reads_of_the_block_are_not_sent(address: int, count: int) -> None:
    with bench("atv21", sets=READ_BLOCK) as here:
        with pytest.raises(RequestRefused):
            await here.session.line.read(1, address, count)
        assert sent(here, 3) == []


@pytest.mark.parametrize(
    ("address", "words"), [(0x1871, [0xC400, 0x1770]), (0x1870, [0xC400, 0x1770, 0])]
)
async def test_invalid_writes_of_the_block_are_not_sent(address: int, words: list[int]) -> None:
    with bench("atv21", sets={"F870": 1, "F871": 3}) as here:
        with pytest.raises(RequestRefused):
            await here.session.line.write(1, address, words)
        assert sent(here, 16) == []


async def test_drive_refuses_an_unassigned_write_block() -> None:
    with bench("atv21") as here:
        with pytest.raises(DeviceException) as refused:
            await here.session.line.write(1, 0x1870, [0xC400, 0x1770])
        assert refused.value.code == 4
        assert sent(here, 16) == ["01101870000204c4001770"]


# Writing an assignment


async def test_moved_slot_is_freed_first() -> None:
    with bench("atv71") as here:
        plan = plan_of(here, "read", ["RFRD", "ETA", "LCR"])
        assert "NMA1, NMA2, NMA3" in await write(here, plan)
        first = here.profile["NMA1"].address
        assert here.writes() == [
            (first, 0), (first + 1, 0), (first, 8604), (first + 1, 3201), (first + 2, 3204),
        ]  # fmt: skip
        assert [here.drive.raw(slot) for slot in plan.block.slots] == list(plan.raws)
        nothing = "Nothing to change: the drive already holds this assignment."
        assert await write(here, plan) == nothing
        here.journal.flush()
        kept = [json.loads(x) for x in here.journal.path.read_text().splitlines()]
        assert [(e["code"], e["new_raw"], e["read_back"]) for e in kept][:2] == [
            ("NMA1", 0, 0), ("NMA2", 0, 0),
        ]  # fmt: skip
        assert {e["why"] for e in kept} == {"scanner inputs"}


@pytest.mark.parametrize("family", ["atv71", "atv21"])
async def test_nothing_is_written_while_the_motor_turns(family: str) -> None:
    with bench(family, run_hz=20.0) as here:
        plan = plan_of(here, "read", ["LCR" if family == "atv71" else "FE03"])
        with pytest.raises(AssignmentRefused, match=r"with the motor stopped.*Nothing was written"):
            await write(here, plan)
        assert here.writes() == []


@pytest.mark.parametrize(
    ("ended", "says"), [(disarmed, "Disarmed"), (stopped, "a stop came after it")]
)
async def test_nothing_is_written_once_the_drive_is_disarmed_or_stopped(
    ended: Callable[[Bench], None], says: str
) -> None:
    with bench("atv71") as here:
        here.after_writes(2, lambda: ended(here))
        plan = plan_of(here, "read", ["RFRD", "ETA", "LCR"])
        with pytest.raises(AssignmentRefused, match=rf"{says}.*Already written: NMA1, NMA2"):
            await write(here, plan)
        assert len(here.writes()) == 2


async def test_foreign_slot_change_is_not_overwritten() -> None:
    with bench("atv71") as here:
        seen = await Mapper(here.session).slots(block(here, "read"))
        here.drive.set("NMA4", 9001)
        with pytest.raises(
            AssignmentRefused, match=r"Another program changed NMA4 from unused to ACC"
        ):
            await write(here, plan_of(here, "read", ["LCR"]), expected=seen)
        assert here.writes() == []


async def test_change_by_another_source_between_two_slots_ends_the_writing() -> None:
    with bench("atv71") as here:
        plan = plan_of(here, "read", ["ETA", "RFRD", "LCR", "OTR"])
        honest = here.session.line.write

        async def disturbed(*what: object, **how: object) -> float:
            done = await honest(*what, **how)  # type: ignore[arg-type]
            here.drive.set("NMA4", 9001)
            return done

        here.session.line.write = disturbed  # type: ignore[method-assign]
        with pytest.raises(AssignmentRefused, match="Another program changed NMA4"):
            await write(here, plan)
        assert here.drive.raw("NMA4") == 9001


LOST = {"line": LineLost("The program that owned it ended."), "answer": NoAnswer(1, 6, 12703)}


@pytest.mark.parametrize("error", LOST.values(), ids=LOST)
@pytest.mark.parametrize("taken", [True, False])
async def test_slot_without_a_reply_is_read_and_not_written_again(
    error: LineError, taken: bool
) -> None:
    with bench("atv71") as here:
        sent = here.lose_answer("NMA3", error, taken=taken)
        plan = plan_of(here, "read", ["ETA", "RFRD", "LCR", "OTR"])
        if taken:
            assert "Wrote NMA3, NMA4, all verified." in await write(here, plan)
        else:
            with pytest.raises(
                AssignmentRefused, match=r"NMA3 was not accept.*Nothing"
            ) as reported:
                await write(here, plan)
            assert reported.value.__cause__ is error
        assert sent == [3204]


async def test_writes_before_line_loss_are_reported() -> None:
    with bench("atv71") as here:
        here.lose_answer("NMA4", LOST["line"], taken=True)
        plan = plan_of(here, "read", ["ETA", "RFRD", "LCR", "OTR"])
        honest = here.session.line.write

        async def then_lost(*what: object, **how: object) -> float:
            try:
                return await honest(*what, **how)  # type: ignore[arg-type]
            except LineLost:
                here.lose_line()
                raise

        here.session.line.write = then_lost  # type: ignore[method-assign]
        says = r"NMA4 was sent, and may.*ended.*Already written: NMA3"
        with pytest.raises(AssignmentRefused, match=says):
            await write(here, plan)


async def test_read_only_line_writes_no_slot() -> None:
    with bench("atv71", read_only=True) as here, pytest.raises(RequestRefused):
        await write(here, plan_of(here, "read", ["LCR"]))


async def test_impossible_mapping_is_refused_before_any_request() -> None:
    with bench("atv71") as here:
        outputs = block(here, "write")
        with pytest.raises(AssignmentRefused, match="already in NCA1"):
            await write(here, plan_of(here, "write", ["CMD", "CMD"]))
        with pytest.raises(AssignmentRefused, match="no parameter"):
            await write(here, empty(outputs).with_raw(0, 3199))
        assert list(here.session.line.trace) == []


# User words


async def test_user_words_are_read_and_kept_per_drive() -> None:
    with bench("atv71", sets={"ACC": 37}) as here:
        assert load_words(here.session) == NO_WORDS
        words = (UserWord(9001, "signed"), UserWord(3199), UserWord(), UserWord(3201))
        raws = await read_words(here.session, words)
        assert raws[:3] == [37, None, None]
        texts = [word.text(raw) for word, raw in zip(words, raws, strict=True)]
        assert texts[:3] == ["37", "-----", "-----"]
        assert texts[3].endswith(" hex")
        assert save_words(here.session, words) == ""
        assert load_words(here.session) == words
        here.session.device = 2
        assert load_words(here.session) == NO_WORDS


@pytest.mark.parametrize("text", ["", "[]", "{", '{"x": 1}'])
async def test_damaged_user_words_are_none(text: str, own_folders: Path) -> None:
    (own_folders / "state").mkdir(exist_ok=True)
    (own_folders / "state" / "user-words.json").write_text(text)
    with bench("atv71") as here:
        assert load_words(here.session) == NO_WORDS


async def test_drive_silent_at_unknown_words_is_not_read_again() -> None:
    with bench("powerdrive") as here:
        words = (UserWord(60000), *NO_WORDS[1:])
        assert await read_words(here.session, words) == [None] * 4
        assert list(here.session.line.trace) == []


async def test_timing_is_that_of_the_line() -> None:
    with bench("atv71") as here:
        await Reader(here.session).read(["ETA"])
        timing = wire_timing(here.session)
        assert timing.character == pytest.approx(10 / 19200, rel=0.11)
        assert 0 < timing.turnaround < 1


async def test_fluctuating_values_are_not_a_difference() -> None:
    sets = {"F875": 1, "F876": 2, "F877": 3, "F878": 4, "F879": 11}
    timing = LineTiming(19200, "8N1", True)
    simulation = Simulation([DriveSpec("atv21", 1, sets=sets, run_hz=35.0)], timing=timing)
    simulation.start()
    opened = open_line(rtu_tcp(simulation), wait=5.0)
    try:
        session = DriveSession(opened.line, 1, library.load("atv21"))
        mapper = Mapper(session)
        read = block_of(session.profile, "read")
        for _ in range(3):
            view = await mapper.look(read)
            assert SlotMatch.CHANGED not in {s.verdict for s in view.slots}
            assert Force.PENDING not in {s.force for s in view.slots}
            assert {s.verdict for s in view.slots} <= {SlotMatch.SAME, SlotMatch.MOVING}
    finally:
        opened.close()
        simulation.stop()
