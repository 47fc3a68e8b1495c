"""Words written through the outputs of simulated drives: only named ones, and verified."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Coroutine, Mapping
from contextlib import asynccontextmanager
from typing import Any

import pytest
from msgspec import structs

from tests.blocks import block_of
from tests.session.sets_bench import Bench, bench, state_known
from tui.bus.errors import RequestRefused
from tui.bus.line import Reply
from tui.drive.blocks.assignment import Assignment, MappingError, empty
from tui.drive.blocks.picking import pick
from tui.drive.blocks.wire_cost import block_request, reach
from tui.drive.errors import DriveError, ValueRefused
from tui.drive.profile.profile import Profile
from tui.session.blocks import exchange as module
from tui.session.blocks.editor import BlockEditor
from tui.session.blocks.exchange import Exchanged
from tui.session.blocks.outputs import (
    ConfirmedWrite,
    example,
    intended,
    refuse_pending,
    values_text,
)
from tui.session.blocks.write import AssignmentRefused
from tui.session.command.commander import Commander
from tui.session.command.stop import Stopper
from tui.session.journal import Entry
from tui.session.journal_reading import read_journal
from tui.session.monitor.monitor import Monitor
from tui.session.settings.write import CUT_SHORT, NotTaken
from tui.session.starts.keeper import StartKeeper
from tui.session.work import Permit

EXAMPLE_IN = ["ETA", "RFRD", "LCR", "OTR", "ULN", "THD", "THR", "LFT"]
EXAMPLE_OUT = ["CMD", "LFRD", "HSP", "LSP", "ACC", "DEC"]


def plan_of(here: Bench, direction: str, codes: list[str]) -> Assignment:
    plan = empty(block_of(here.profile, direction))
    for place, code in enumerate(codes):
        plan = pick(here.profile, plan, place, code)
    return plan


def sent(here: Bench, function: int) -> list[str]:
    """The bodies of all requests of a function so far, without checksum."""
    frames = [f.data for f in here.session.line.trace if f.direction == "out"]
    return [data[:-2].hex() for data in frames if data[1] == function]


async def both(here: Bench) -> tuple[Assignment, Assignment]:
    inputs, outputs = plan_of(here, "read", EXAMPLE_IN), plan_of(here, "write", EXAMPLE_OUT)
    for slot, raw in {**inputs.slots, **outputs.slots}.items():
        here.drive.set(slot, raw)
    return inputs, outputs


async def exchange(
    here: Bench,
    outputs: Assignment,
    wanted: Mapping[str, int],
    inputs: Assignment | None = None,
    *,
    in_force: bool = False,
) -> Exchanged:
    """An exchange with a drive that is armed."""
    return await module.exchange(
        here.session,
        here.journal,
        outputs,
        wanted,
        inputs,
        permit=here.permit(),
        in_force=in_force,
    )


async def test_eight_inputs_and_six_outputs_in_one_exchange() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        inputs, outputs = await both(here)
        first = {code: here.drive.raw(code) for code in EXAMPLE_OUT}
        wanted = {EXAMPLE_OUT[0]: first[EXAMPLE_OUT[0]], "ACC": 45, "DEC": 55}
        done = await exchange(here, outputs, wanted, inputs)
        (request,) = sent(here, 23)
        held = {code: here.drive.raw(code) for code in EXAMPLE_OUT}
        words = tuple(held[code] & 0xFFFF for code in EXAMPLE_OUT)
        assert request == block_request(here.profile, 1, inputs, outputs, words)[:-2].hex()
        assert request.startswith("011731c5000831d900060c")
        assert (held["ACC"], held["DEC"]) == (45, 55)
        assert set(done.inputs) == set(EXAMPLE_IN)
        assert done.outputs == held
        kept = {e.code: (e.new_raw, e.read_back) for e in here.journal.recent}
        assert kept["ACC"] == (45, 45)
        assert set(kept) == set(EXAMPLE_OUT)


@pytest.mark.parametrize(
    ("wanted", "error", "says"),
    [
        ({"LCR": 1}, AssignmentRefused, "no output slot is mapped to LCR"),
        ({"ACC": 70000}, ValueRefused, "does not fit|out of range"),
    ],
)
async def test_invalid_exchange_is_refused_before_sending(
    wanted: Mapping[str, int], error: type[Exception], says: str
) -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        inputs, outputs = await both(here)
        with pytest.raises(error, match=says):
            await exchange(here, outputs, wanted, inputs)
        assert sent(here, 23) == []


async def test_exchange_needs_arming_and_the_interlocks_of_a_command() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        inputs, outputs = await both(here)
        with pytest.raises(AssignmentRefused, match="Not armed"):
            await module.exchange(
                here.session,
                here.journal,
                outputs,
                {"ACC": 40},
                inputs,
                permit=Permit(here.session.work, here.session.work.stops),
            )
        here.drive.set("CCC", 1)
        here.drive.set("CHCF", 1)
        here.drive.set("NCA1", 3204)
        with pytest.raises(AssignmentRefused, match="another program changed"):
            await exchange(here, outputs, {"ACC": 40}, inputs)
        assert sent(here, 23) == []


async def test_outputs_moved_during_an_exchange_are_reported() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        inputs, outputs = await both(here)
        honest = here.session.line.read_write

        async def moved(*what: object, **how: object) -> Reply:
            here.drive.set("NCA5", 9002)
            here.drive.set("NCA6", 9001)
            return await honest(*what, **how)  # type: ignore[arg-type]

        here.session.line.read_write = moved  # type: ignore[method-assign]
        with pytest.raises(AssignmentRefused, match=r"NCA5, NCA6.*Check"):
            await exchange(here, outputs, {"ACC": 40}, inputs)


async def test_only_named_values_are_written() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        inputs, outputs = await both(here)
        done = await exchange(here, outputs, {"ACC": 45, "DEC": 55}, inputs)
        assert done.outputs == {"ACC": 45, "DEC": 55}
        (request,) = sent(here, 23)
        # two words from NC5 on: command word and references are not touched
        assert request.endswith("31dd000204002d0037")
        reported = {(entry.code, entry.new) for entry in here.journal.recent}
        assert reported == {("ACC", "4.5 s"), ("DEC", "5.5 s")}


async def test_value_between_two_named_values_is_kept() -> None:
    with bench("atv71", sets={"CHCF": 1, "LSP": 41}) as here:
        _, outputs = await both(here)
        assert reach(here.profile, outputs, ["ACC", "HSP"]) == range(2, 5)
        done = await exchange(here, outputs, {"HSP": 450, "ACC": 45})
        assert done.outputs == {"HSP": 450, "LSP": 41, "ACC": 45}
        assert sent(here, 23) == []
        assert sent(here, 16)[-1].endswith("31db00030601c20029002d")


async def test_start_is_recorded_before_its_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A standstill read before the frame must not end the record."""
    with bench("atv71", sets={"CHCF": 1}) as here:
        _, outputs = await both(here)
        keeper = here.session.starts = StartKeeper("test")
        reported: list[tuple[str, int]] = []
        for name in ("begin", "sent"):
            honest = getattr(keeper, name)

            def note(*what: object, name: str = name, honest: Any = honest) -> None:
                reported.append((name, len(sent(here, 16))))
                honest(*what)

            monkeypatch.setattr(keeper, name, note)
        await exchange(here, outputs, {"ACC": 45})
        assert reported == []
        await exchange(here, outputs, {"CMD": 6})
        assert reported == [("begin", 1), ("sent", 2)]
        keeper.close()


async def test_exchange_without_values_writes_nothing() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        _, outputs = await both(here)
        with pytest.raises(AssignmentRefused, match="no output was named"):
            await exchange(here, outputs, {})
        assert sent(here, 16) == []


async def test_value_not_kept_by_the_drive_is_reported() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        _, outputs = await both(here)
        honest = here.session.line.write

        async def undone(*what: object, **how: object) -> float:
            reply = await honest(*what, **how)  # type: ignore[arg-type]
            here.drive.set("ACC", 99)
            return reply

        here.session.line.write = undone  # type: ignore[method-assign]
        with pytest.raises(NotTaken, match=r"written as 4\.5 s, but the drive holds 9\.9 s"):
            await exchange(here, outputs, {"ACC": 45})
        assert here.journal.recent[-1].answer == "holds another value"


async def test_read_only_line_exchanges_nothing() -> None:
    with bench("atv71", read_only=True) as here:
        outputs = plan_of(here, "write", ["ACC"])
        with pytest.raises(RequestRefused):
            await exchange(here, outputs, {"ACC": 45})


# The write block of the Altivar 21

EXAMPLE_21 = {"F870": 1, "F871": 3}
"""Command word 1 and frequency reference, as in manual 7.8."""


async def test_two_words_of_the_manual_are_written_through_the_write_block() -> None:
    with bench("atv21", sets=EXAMPLE_21) as here:
        outputs = plan_of(here, "write", ["FA00", "FA01"])
        wanted = {"FA00": 0xC400, "FA01": 6000}
        with pytest.raises(AssignmentRefused, match="was not confirmed"):
            await exchange(here, outputs, wanted)
        assert sent(here, 16) == []
        done = await exchange(here, outputs, wanted, in_force=True)
        assert done.outputs == wanted
        assert sent(here, 16) == ["01101870000204c4001770"]
        assert here.drive.raw("FA01") == 6000


async def test_one_named_word_of_the_write_block_writes_both() -> None:
    with bench("atv21", sets=EXAMPLE_21) as here:
        here.drive.set("FA00", 0x8000)
        outputs = plan_of(here, "write", ["FA00", "FA01"])
        await exchange(here, outputs, {"FA01": 3000}, in_force=True)
        assert sent(here, 16) == ["011018700002048000" + "0bb8"]


async def test_remapped_write_block_is_detected() -> None:
    with bench("atv21", sets={"F870": 4, "F871": 5}) as here:
        for slot, raw in {"F870": 4, "F871": 3}.items():
            address = here.profile[slot].address
            await here.session.line.write(1, address, [raw])
        outputs = plan_of(here, "write", ["FA50", "FA01"])
        here.drive.set("FA51", 7)
        with pytest.raises(NotTaken, match=r"not that of its slots.*FA51 changed to"):
            await exchange(here, outputs, {"FA01": 500}, in_force=True)


# A stop


async def test_write_cut_by_stop_is_not_recorded_as_done(monkeypatch: pytest.MonkeyPatch) -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        _, outputs = await both(here)
        task = await unanswered(monkeypatch, here, exchange(here, outputs, {"ACC": 45}))
        task.cancel()
        await asyncio.wait([task])
        (kept,) = [e for e in here.journal.recent if e.code == "ACC"]
        assert (kept.answer, kept.read_back) == (CUT_SHORT, None)
        here.session.image.confirm("ACC", 45, here.session.clock.monotonic())
        assert here.journal.flush(60)
        *_, later = [e for e in read_journal(here.journal.files) if isinstance(e, Entry)]
        assert (later.kind, later.of, later.read_back) == ("read-back", kept.time, 45)


async def unanswered(
    monkeypatch: pytest.MonkeyPatch, here: Bench, work: Coroutine[Any, Any, Any]
) -> asyncio.Task[Any]:
    """A write that has begun and gets no reply."""
    begun = asyncio.Event()

    async def write(*_: Any, **__: Any) -> None:
        begun.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(here.session.line, "write", write)
    task = asyncio.create_task(work)
    await begun.wait()
    return task


async def settled(block_editor: BlockEditor) -> str:
    for _ in range(400):
        if (
            not block_editor.busy
            and block_editor.message is not None
            and block_editor.message.kind != "working"
        ):
            return block_editor.message.text
        await asyncio.sleep(0.02)
    raise AssertionError("it does not end")


async def test_stop_ends_an_exchange_before_its_words_are_sent() -> None:
    with bench("atv71", sets={"CHCF": 1}) as here:
        await both(here)
        monitor = Monitor(here.session)
        monitor.start(period=0.1)
        block_editor = BlockEditor(here.session, monitor, here.journal)
        block_editor.start()
        for _ in range(400):
            if len(block_editor.views) == 2:
                break
            await asyncio.sleep(0.02)
        stopper = Stopper(here.session.line, here.journal)
        here.permit()
        block_editor.exchange(block_editor.intended("CMD=16#000F LFRD=900"))
        stopper.stop([here.session])
        assert "stop" in await settled(block_editor)
        await asyncio.sleep(0.5)
        assert sent(here, 23) == []
        block_editor.stop()
        monitor.stop()


async def test_stop_ends_the_writing_of_slots_and_later_commands() -> None:
    with bench("atv71") as here:
        monitor = Monitor(here.session)
        monitor.start(period=0.1)
        block_editor = BlockEditor(here.session, monitor, here.journal)
        block_editor.start()
        for _ in range(400):
            if len(block_editor.views) == 2 and state_known(monitor):
                break
            await asyncio.sleep(0.02)
        commander = Commander(here.session, here.journal)
        here.permit()
        block_editor.proposals.propose(plan_of(here, "read", EXAMPLE_IN))
        block_editor.write_proposals()
        commander.order("forward")
        assert here.session.work.busy_for(commander)
        stopper = Stopper(here.session.line, here.journal)
        stopper.stop([here.session])
        assert "ended by a stop" in (await settled(block_editor)).lower()
        await asyncio.sleep(0.5)
        assert commander.outcome is not None
        assert "ended by a stop" in commander.outcome.text.lower()
        assert not here.session.work.busy_for(commander)
        assert here.drive.motor.frequency == 0
        assert {word for register, word in here.writes() if register == 8501} <= {7}
        assert here.drive.raw("NMA8") != 7121
        # what was proposed stays, against what the drive holds now
        assert block_editor.proposals.changes(plan_of(here, "read", []).block)
        block_editor.write_proposals()
        assert "no longer armed" in await settled(block_editor)
        assert here.drive.raw("NMA8") != here.profile["LFT"].address
        here.permit()
        block_editor.write_proposals()
        assert ", all verified." in await settled(block_editor)
        assert here.drive.raw("NMA8") == here.profile["LFT"].address
        block_editor.stop()
        monitor.stop()


@asynccontextmanager
async def at_desk(here: Bench) -> AsyncIterator[BlockEditor]:
    """A block editor that knows the blocks of an armed drive."""
    monitor = Monitor(here.session)
    monitor.start(period=0.1)
    block_editor = BlockEditor(here.session, monitor, here.journal)
    block_editor.start()
    for _ in range(400):
        if len(block_editor.views) == 2:
            break
        await asyncio.sleep(0.02)
    here.permit()
    yield block_editor
    block_editor.stop()
    monitor.stop()


async def test_write_cut_by_stop_is_reported_as_remaining() -> None:
    with bench("atv71") as here:
        async with at_desk(here) as block_editor:
            here.after_writes(2, lambda: here.session.work.stop("F12"))
            block_editor.proposals.propose(plan_of(here, "read", EXAMPLE_IN))
            block_editor.write_proposals()
            ended = "Ended by a stop. Values that were already written stay."
            assert await settled(block_editor) == ended
            assert len(here.writes()) == 2


async def test_nothing_written_reports_nothing_remaining() -> None:
    with bench("atv71", run_hz=20.0) as here:
        async with at_desk(here) as block_editor:
            block_editor.proposals.propose(plan_of(here, "read", EXAMPLE_IN))
            block_editor.write_proposals()
            assert (await settled(block_editor)).endswith("Nothing was written.")
            assert here.writes() == []


async def test_partly_written_slots_still_wait_for_a_reset() -> None:
    with bench("atv21", sets=EXAMPLE_21) as here:
        monitor = Monitor(here.session)
        monitor.start(period=0.1)
        block_editor = BlockEditor(here.session, monitor, here.journal)
        block_editor.start()
        for _ in range(400):
            if len(block_editor.views) == 2 and state_known(monitor):
                break
            await asyncio.sleep(0.02)
        # disarmed as soon as one slot is another
        block_editor.proposals.propose(plan_of(here, "write", ["FA50", "FA51"]))
        here.permit()
        disarm = here.session.arming.disarm
        here.after_writes(1, lambda: disarm("Disarmed: no key pressed for 60 s."))
        block_editor.write_proposals()
        assert "Disarmed" in await settled(block_editor)
        assert (here.drive.raw("F870"), here.drive.raw("F871")) == (4, 3)
        with pytest.raises(MappingError, match="Not in effect yet: F870"):
            block_editor.intended("FA50=0x0000")
        block_editor.stop()
        monitor.stop()


# What a person agrees to


def intended_of(
    here: Bench, outputs: Assignment, text: str, inputs: Assignment | None = None
) -> ConfirmedWrite:
    return intended(here.profile, 1, outputs, inputs, {"INR": 1, "LFRD": 900}, (), text)


def test_values_and_frame_are_shown_before_sending() -> None:
    with bench("atv71") as here:
        inputs, outputs = plan_of(here, "read", EXAMPLE_IN), plan_of(here, "write", EXAMPLE_OUT)
        reported = intended_of(here, outputs, "cmd=16#000F hsp=45", inputs)
        assert reported.wanted == {"CMD": 15, "HSP": 450}
        first, second, third, *rest = reported.follows.splitlines()
        assert (first, second) == ("NCA1: CMD 16#000F", "NCA3: HSP 45.0 Hz")
        assert "Also written, with the value that is read just before: LFRD" in third
        # three words from NC1 on: the command, the current reference, the high speed
        label, frame = rest[-1].split(": ")
        assert label == "Frame with LFRD 900 rpm"
        assert frame.replace(" ", "").lower().startswith("011731c5000831d9000306000f038401c2")


def test_value_with_an_unknown_scale_is_shown_raw() -> None:
    with bench("atv71") as here:
        outputs = plan_of(here, "write", EXAMPLE_OUT)
        reported = intended(here.profile, 1, outputs, None, {"LFRD": 900}, (), "acc=16#0032")
        assert "ACC 50 raw" in reported.follows
        known = {"LFRD": 900, "INR": 1}
        reported = intended(here.profile, 1, outputs, None, known, (), "acc=16#0032")
        assert "ACC 5.0 s" in reported.follows


def test_scale_without_its_parameter_is_the_one_that_the_profile_gives() -> None:
    with bench("atv71") as here:
        outputs = plan_of(here, "write", EXAMPLE_OUT)
        data = here.profile.data
        assert here.profile["ACC"].scale_by is not None
        fixed = structs.replace(here.profile["ACC"].scale_by, absent="0.1")
        parameters = [
            structs.replace(each, scale_by=fixed) if each.code == "ACC" else each
            for each in data.parameters
        ]
        profile = Profile(structs.replace(data, parameters=parameters))
        with pytest.raises(ValueRefused, match="INR"):
            intended(profile, 1, outputs, None, {"LFRD": 900}, (), "acc=5")
        reported = intended(profile, 1, outputs, None, {"LFRD": 900}, {"INR"}, "acc=5")
        assert reported.wanted == {"ACC": 50}
        assert "ACC 5.0 s" in reported.follows
        assert example(profile, outputs, {"CMD": 0, "LFRD": 900}, {"INR"}) == "CMD=16#0000 LFRD=900"
        assert values_text(profile, {"ACC": 50}, {}, {"INR"}) == "ACC 5.0 s"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "CODE=VALUE"),
        ("ACC", "CODE=VALUE"),
        ("LCR=3", "one of CMD, LFRD"),
        ("NOPE=3", "NOPE"),
        ("ACC=abc", "ACC"),
        ("ACC=99999", "out of range"),
    ],
)
def test_impossible_output_is_reported(text: str, says: str) -> None:
    with bench("atv71") as here, pytest.raises(DriveError, match=says):
        intended_of(here, plan_of(here, "write", EXAMPLE_OUT), text)


def test_slots_waiting_for_a_reset_are_not_used_for_writing() -> None:
    with bench("atv21") as here:
        outputs = plan_of(here, "write", ["FA00", "FA01"])
        with pytest.raises(MappingError, match="Not in effect yet: F871"):
            refuse_pending(outputs, {"F871": 3, "F875": 1})
        # slots of the other block, and unwritten ones, block nothing
        refuse_pending(outputs, {"F875": 1, "F870": 6})
        reported = intended_of(here, outputs, "FA00=16#0400 FA01=60")
        assert "F870 and F871 were set before" in reported.follows
        # this drive has no function 23: a write of two words, and nothing comes back
        assert "Frame: 01 10 18 70 00 02 04" in reported.follows
        assert reported.inputs is None
