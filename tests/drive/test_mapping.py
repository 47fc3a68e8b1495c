"""Assignments of blocks and scanner: examples of the manuals byte for byte, general properties."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.blocks import block_of
from tui.drive.blocks.assignment import (
    UNUSED,
    Assignment,
    MappingError,
    assignment,
    describe,
    empty,
    factory,
    has_blocks,
    no_blocks,
    place_of,
    slot_changes,
    slot_target,
    steps,
)
from tui.drive.blocks.file import dump_blocks, load_blocks
from tui.drive.blocks.picking import choices, pick, raw_named
from tui.drive.blocks.slot_rules import assignment_problems, refusing
from tui.drive.blocks.user_words import UserWord, format_named, is_no_value, word_named
from tui.drive.blocks.wire_cost import block_request, cost, microseconds, saving, stretches
from tui.drive.errors import DriveError, UnknownParameter
from tui.drive.profile import library
from tui.drive.profile.schema import Block
from tui.drive.read_plan import WireTiming, plan_reads
from tui.wire.frames import crc16, hex_text

ATV21, ATV71 = library.load("atv21"), library.load("atv71")
TIMING = WireTiming()
WITHOUT = ["atv31", "atv312", "powerdrive", "proxidrive", "varmeca"]
EXAMPLE_IN = ["ETA", "RFRD", "LCR", "OTR", "ULN", "THD", "THR", "LFT"]
EXAMPLE_OUT = ["CMD", "LFRD", "HSP", "LSP", "ACC", "DEC"]


def block(family: str, direction: str) -> Block:
    return block_of(library.load(family), direction)


def made(family: str, direction: str, codes: list[str]) -> Assignment:
    """An assignment with these codes in the first slots."""
    profile = library.load(family)
    plan = empty(block(family, direction))
    for place, code in enumerate(codes):
        plan = pick(profile, plan, place, code)
    return plan


# The manuals' examples


def test_manual_example_of_the_scanner_by_function_23_matches() -> None:
    inputs, outputs = made("atv71", "read", EXAMPLE_IN), made("atv71", "write", EXAMPLE_OUT)
    assert inputs.raws == (3201, 8604, 3204, 3205, 3207, 3209, 9630, 7121)
    assert outputs.raws == (8501, 8602, 3104, 3105, 9001, 9002, 0, 0)
    words = (0x000F, 0x1388, 0x1F40, 0x01F4, 0x04B0, 0x0258)
    sent = block_request(ATV71, 20, inputs, outputs, words)
    assert sent.hex() == "141731c5000831d900060c000f13881f4001f404b00258563d"
    assert (
        refusing(assignment_problems(ATV71, inputs))
        == refusing(assignment_problems(ATV71, outputs))
        == []
    )


@pytest.mark.parametrize(
    ("codes", "sent"),
    [
        (["FD01", "FD00", "FE03", "FE05", "FC91"], "01031875000592B3"),
        (["FD01", "FD00"], "010318750002D371"),
        (["FD01"], "010318750002D371"),  # two words at least
    ],
)
def test_manual_examples_of_the_read_block_match(codes: list[str], sent: str) -> None:
    assert block_request(ATV21, 1, made("atv21", "read", codes), None).hex().upper() == sent


def test_manual_example_of_the_write_block_matches() -> None:
    outputs = made("atv21", "write", ["FA00", "FA01"])
    assert outputs.raws == (1, 3)
    sent = block_request(ATV21, 1, None, outputs, (0xC400, 0x1770))
    assert sent[:-2].hex().upper() == "01101870000204C4001770"
    assert crc16(sent) == 0
    assert hex_text(sent).startswith("01 10 18 70 00 02 04")


def test_factory_assignment_is_that_of_the_manual() -> None:
    assert factory(ATV71, block("atv71", "read")).raws == (3201, 8604, 0, 0, 0, 0, 0, 0)
    assert factory(ATV71, block("atv71", "write")).raws == (8501, 8602, 0, 0, 0, 0, 0, 0)
    assert factory(ATV21, block("atv21", "read")).raws == (0,) * 5
    assert factory(ATV21, block("atv21", "write")).raws == (0, 0)


@pytest.mark.parametrize("family", WITHOUT)
def test_families_without_blocks_say_so(family: str) -> None:
    profile = library.load(family)
    assert not has_blocks(profile)
    assert "neither" in no_blocks(profile)
    with pytest.raises(MappingError, match="has no slot"):
        place_of(profile, "NMA1")


# Picking and what is wrong


@pytest.mark.parametrize(
    ("family", "direction", "typed", "raw"),
    [
        ("atv71", "read", "lcr", 3204),
        ("atv71", "read", "W3204", 3204),
        ("atv71", "read", "16#0C84", 3204),
        ("atv71", "read", "3204", 3204),
        ("atv71", "read", "none", 0),
        ("atv21", "read", "FE90", 11),
        ("atv21", "read", "16#FE90", 11),
        ("atv21", "write", "FA13", 6),
        ("atv21", "write", "", 0),
    ],
)
def test_typed_numbers_are_accepted(family: str, direction: str, typed: str, raw: int) -> None:
    assert raw_named(library.load(family), block(family, direction), typed) == raw


@pytest.mark.parametrize(
    ("family", "direction", "typed", "says"),
    [
        ("atv21", "read", "FE18", "cannot hold"),
        ("atv21", "write", "FD01", "cannot hold"),
        ("atv71", "write", "ETA", "can only be read"),
        ("atv71", "read", "NMA3", "belongs to the scanner"),
        ("atv71", "write", "NC1", "belongs to the scanner"),
        ("atv71", "read", "W3199", "No parameter"),
        ("atv71", "read", "nonsense", "no parameter"),
    ],
)
def test_impossible_slot_target_is_reported(
    family: str, direction: str, typed: str, says: str
) -> None:
    profile = library.load(family)
    if typed == "FE18" and profile.get("FE18") is None:
        typed = next(p.code for p in profile.parameters if p.code.startswith("FE1"))
    with pytest.raises((MappingError, UnknownParameter), match=says):
        raw_named(profile, block(family, direction), typed)


def test_duplicate_is_an_error_in_outputs_and_a_waste_in_inputs() -> None:
    (wrong,) = assignment_problems(ATV71, made("atv71", "write", ["CMD", "CMD"]))
    assert wrong.refuses
    assert "already in NCA1" in wrong.text
    (waste,) = assignment_problems(ATV71, made("atv71", "read", ["ETA", "ETA"]))
    assert not waste.refuses


def test_unknown_address_is_a_problem_of_its_slot() -> None:
    plan = empty(block("atv71", "read")).with_raw(3, 3199)
    (wrong,) = assignment_problems(ATV71, plan)
    assert (wrong.slot, wrong.refuses) == ("NMA4", True)
    (wrong,) = assignment_problems(ATV21, empty(block("atv21", "read")).with_raw(0, 99))[:1]
    assert "not one of its 11 choices" in wrong.text


def test_write_block_whose_first_slot_is_unused_is_refused_by_the_drive() -> None:
    plan = empty(block("atv21", "write")).with_raw(1, 3)
    assert any("exception 4" in p.text and p.refuses for p in assignment_problems(ATV21, plan))
    hole = made("atv21", "read", ["FD01", "none", "FE03"])
    assert [p.refuses for p in assignment_problems(ATV21, hole)] == [False]


@pytest.mark.parametrize(("direction", "does"), [("read", "read"), ("write", "written")])
def test_block_with_too_few_slots_has_a_remark(direction: str, does: str) -> None:
    shown = block("atv21", direction)
    plan = empty(shown).with_raw(0, 1)
    (remark,) = assignment_problems(ATV21, plan)
    few = f"Map more slots: at least {shown.min_words} words are {does} at once."
    assert (remark.slot, remark.text, remark.refuses) == (shown.slots[1], few, False)


def test_parameter_that_this_drive_lacks_is_reported() -> None:
    (wrong,) = assignment_problems(ATV71, made("atv71", "read", ["LCR"]), {"LCR"})
    assert "reports that it has no LCR" in wrong.text


def test_list_is_filtered_by_the_typed_text() -> None:
    inputs = block("atv71", "read")
    every = choices(ATV71, inputs)
    assert len(every) > 300
    assert choices(ATV71, inputs, "lcr")[0].code == "LCR"
    assert [p.code for p in choices(ATV71, inputs, "W3204")] == ["LCR"]
    assert {"ETA"} <= {p.code for p in choices(ATV71, inputs, "status word")}
    assert len(choices(ATV21, block("atv21", "read"))) == 11
    assert len(choices(ATV21, block("atv21", "write"))) == 6
    assert choices(ATV71, inputs, "no such thing at all") == []


# What always holds

ADDRESSES = [p.address for p in choices(ATV71, block("atv71", "read"))]
RAWS = st.lists(st.one_of(st.just(UNUSED), st.sampled_from(ADDRESSES)), min_size=8, max_size=8).map(
    tuple
)


@given(before=RAWS, after=RAWS)
def test_steps_reach_the_assignment_and_free_slots_before_moving(
    before: tuple[int, ...], after: tuple[int, ...]
) -> None:
    inputs = block("atv71", "read")
    plan = Assignment(inputs, after)
    held = Assignment(inputs, before).slots
    twice_before = {raw for raw in before if raw and before.count(raw) > 1}
    for step in steps(held, plan):
        assert held[step.slot] == step.old
        held[step.slot] = step.new
        if step.new and after.count(step.new) == 1 and step.new not in twice_before:
            assert list(held.values()).count(step.new) == 1
    assert tuple(held.values()) == after
    assert not steps(held, plan)
    assert {c.slot for c in slot_changes(Assignment(inputs, before).slots, plan)} == {
        slot
        for slot, number, other in zip(inputs.slots, before, after, strict=True)
        if number != other
    }


@given(raws=RAWS, place=st.integers(0, 7), step=st.sampled_from([-1, 1]))
def test_moving_a_slot_back_restores_the_assignment(
    raws: tuple[int, ...], place: int, step: int
) -> None:
    plan = Assignment(block("atv71", "read"), raws)
    moved = plan.moved(place, step)
    assert sorted(moved.raws) == sorted(raws)
    assert moved.moved(place + step, -step) == plan or not 0 <= place + step < 8


@given(raws=RAWS)
def test_file_round_trip_keeps_the_assignment(raws: tuple[int, ...]) -> None:
    inputs = Assignment(block("atv71", "read"), raws)
    outputs = factory(ATV71, block("atv71", "write"))
    text = dump_blocks(ATV71, [inputs, outputs], "pump 3")
    assert load_blocks(text, "x.toml", ATV71) == {"scanner-read": inputs, "scanner-write": outputs}
    whole = text.rstrip()
    for end in range(0, len(whole), 41):
        with pytest.raises(MappingError, match=r"x\.toml:\d+: "):
            load_blocks(whole[:end], "x.toml", ATV71)


@given(raws=RAWS)
def test_assignment_never_makes_the_cheapest_plan_slower(raws: tuple[int, ...]) -> None:
    plan = Assignment(block("atv71", "read"), raws)
    found = saving(ATV71, EXAMPLE_IN, TIMING, {}, plan.slots)
    assert found.microseconds >= 0
    assert (
        found.after.microseconds == plan_reads(ATV71, EXAMPLE_IN, TIMING, plan.slots).microseconds
    )
    codes = {describe(ATV71, plan.block, raw) for raw in raws}
    if not codes & set(EXAMPLE_IN):
        assert found.microseconds == 0


# What it costs


def test_read_block_saves_three_requests_of_five() -> None:
    codes = ["FD01", "FD00", "FE03", "FE05", "FE90"]
    plan = made("atv21", "read", codes)
    found = saving(ATV21, codes, TIMING, {}, plan.slots)
    assert (found.before.requests, found.after.requests) == (5, 1)
    assert found.before.microseconds == round(5 * TIMING.read(1) * 1e6)
    assert found.after.microseconds == round(TIMING.read(5) * 1e6)
    assert found.microseconds == found.before.microseconds - found.after.microseconds


def test_scanner_cost_includes_the_check_of_its_slots() -> None:
    codes = ["ETA", "ACC", "THR", "LFT"]
    plan = made("atv71", "read", codes)
    found = cost(ATV71, codes, TIMING, plan.slots)
    assert found.requests == 2
    assert found.microseconds == round(2 * TIMING.read(4) * 1e6)


def test_exchange_time_shown_is_that_of_its_requests() -> None:
    inputs, outputs = made("atv71", "read", EXAMPLE_IN), made("atv71", "write", EXAMPLE_OUT)
    assert microseconds(ATV71, TIMING, inputs, outputs) == round(TIMING.read_write(8, 6) * 1e6)
    assert microseconds(ATV71, TIMING, inputs, None) == round(TIMING.read(8) * 1e6)
    write = TIMING.write(6, multiple=True)
    assert microseconds(ATV71, TIMING, None, outputs) == round(write * 1e6)
    nothing = empty(block("atv71", "read"))
    assert microseconds(ATV71, TIMING, nothing, None) == 0
    assert block_request(ATV71, 1, nothing, None) == b""


@pytest.mark.parametrize("family", WITHOUT)
def test_neighbors_are_suggested_within_the_limit(family: str) -> None:
    profile = library.load(family)
    codes = [value.parameter for value in profile.data.monitoring.values]
    found = stretches(profile, codes, TIMING)
    assert found, "the monitoring set has neighbors"
    function = profile.function(3)
    assert function is not None
    brought = [code for stretch in found for code in stretch.codes]
    assert len(brought) == len(set(brought))
    for stretch in found:
        assert stretch.request.count <= (function.max_read or 0)
        assert stretch.cost < stretch.alone
        assert stretch.cost == round(TIMING.read(stretch.request.count) * 1e6)
    assert found[0].saves == max(stretch.saves for stretch in found)


def test_single_word_drive_has_no_neighbor_ranges() -> None:
    assert stretches(ATV21, ["FD00", "FD01", "FE03"], TIMING) == []


# Files

GOOD = dump_blocks(ATV21, [factory(ATV21, block("atv21", "read"))])


@pytest.mark.parametrize(
    ("old", "new", "line", "says"),
    [
        ('F876 = "none"', 'F876 = "FA00"', 7, "cannot hold"),
        ('F876 = "none"', "F876 = 12", 7, "not one of the 11 choices"),
        ('F876 = "none"', "F876 = 1.5", 7, "neither a code nor a number"),
        ('F876 = "none"', 'F999 = "none"', 7, "not a slot"),
        ('F876 = "none"\n', "", 5, "F876 is missing"),
        ("[read]", "[red]", 5, "no block"),
        ('"atv21"', '"atv71"', 3, "the drive is 'atv21'"),
        ("format = 1", "format = 2", 2, "format 2"),
        ("slots = 5", "slots = 6", 13, "6 slots"),
        ("[end]", "[end", 12, "not an assignment"),
    ],
)
def test_invalid_file_is_refused_with_its_line(old: str, new: str, line: int, says: str) -> None:
    assert old in GOOD
    with pytest.raises(MappingError, match=says) as error:
        load_blocks(GOOD.replace(old, new), "block.toml", ATV21)
    assert str(error.value).startswith(f"block.toml:{line}: ")


def test_hand_written_file_is_accepted() -> None:
    text = GOOD.replace('F875 = "none"', "F875 = 1").replace('F876 = "none"', 'F876 = "16#FD00"')
    plan = load_blocks(text, "x", ATV21)["read"]
    assert plan.raws == (1, 2, 0, 0, 0)
    second = slot_target(ATV21, plan.block, 2)
    assert second is not None
    assert second.code == "FD00"


def test_unread_slots_are_not_an_assignment() -> None:
    inputs = block("atv21", "read")
    assert assignment(inputs, {"F875": 1}) is None
    assert assignment(inputs, dict.fromkeys(inputs.slots, 1)) is not None
    assert describe(ATV21, inputs, None) == "-----"


# User words


@pytest.mark.parametrize(
    ("word", "raw", "text"),
    [
        (UserWord(3204, "signed"), 53, "53"),
        (UserWord(3205, "signed"), 0xFFFF, "-1"),
        (UserWord(3205, "unsigned"), 0xFFFF, "65535"),
        (UserWord(7121, "hex"), 0, "0000 hex"),
        (UserWord(0, "hex"), 12, "-----"),
        (UserWord(3200, "hex"), None, "-----"),
    ],
)
def test_user_words_are_shown_as_on_the_drive_keypad(
    word: UserWord, raw: int | None, text: str
) -> None:
    assert word.text(raw) == text


def test_user_words_are_named_by_code_number_or_any_address() -> None:
    assert word_named(ATV71, "lcr").address == 3204
    assert word_named(ATV71, "W3200").address == 3200
    assert word_named(ATV71, "none").address == 0
    assert format_named(" Signed ") == "signed"
    assert is_no_value(ATV71, [0x8000])
    assert not is_no_value(ATV21, [0x8000])
    for wrong in ("70000", "nonsense"):
        with pytest.raises(DriveError):
            word_named(ATV71, wrong)
    with pytest.raises(MappingError):
        format_named("octal")
