"""Files and plans made of one invented profile, right and damaged, as text.

`whole_files.txt` has a section for each subject: what was changed, and the result or the error.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import pytest
from msgspec import structs

from tests.drive.test_whole_values import HELD, OTHER, whole
from tests.recorded import result, sections, short
from tui.drive.blocks import assignment, file, picking, slot_rules, user_words, wire_cost
from tui.drive.profile.csv_file import profile_from_table
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import WireTiming, plan_reads
from tui.drive.settings import recipes, replacement, set_file
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.drive.settings.restore_plan import Held, Options
from tui.drive.settings.restore_planner import plan_restore

TEXTS = Path(__file__).parent / "whole_files.txt"
HEAD = SetHead(
    "example-fan", "1.2", "Example fan drive", "2026-01-02T03:04:05+01:00", "rtu:x", 7, "1.0",
    {"vendor": "Example", "reference": "EXFAN-22", "version": "1.2"},
)  # fmt: skip
OWN_SET = ParameterSet(HEAD, HELD, {"ANIN": "exception 2", "SLT1": "no reply"})
# each with what replaces it
SET_DAMAGES = (
    ("format = 1", "format = 2"), ("format = 1\n", ""), ("[set]", "[sets]"),
    ('profile = "example-fan"\n', ""), ("parameters = 36", "parameters = 35"), ("[end]", "[ende]"),
    ("raw = 30,", ""), ("raw = 30, value = \"3.0 s\"", 'value = "4.56 s"'),
    ("raw = 30, value = \"3.0 s\"", 'value = "4.5"'), ("raw = 30,", "raw = 31,"),
    ("raw = 30,", "raw = 99999,"), ("raw = 30,", 'raw = "30",'), ("ACCE = {", "ACCEL = {"),
    ("ACCE = {", "TEMP = {"), ("raw = 30, value = \"3.0 s\", name", "name"),
    ('value = "Modbus"', 'value = "Bus"'), ("raw = 1, value = \"Modbus\"", 'value = "Bus"'),
    ("raw = 48, value = \"4.8 A\"", 'value = "4.83 A"'), ("INCR = {", "# {"),
    ("device = 7", 'device = "7"'), ("[identity]", "[identity"), ("ACCE = {", "ACCE = 3 # {"),
    ("[parameters.Settings]", "[parameters]\nSettings = 3\n[parameters.Other]"),
)  # fmt: skip
TABLE = """code;name;number;address;type;unit;scale;min;max;factory;values;access;quantity;function
P1;Ramp;10;9001;uint16;s;0,1;0,1;999.9;3;;rw;acceleration;
P2;Mode;11;16#10;;;;;;1;0=Off; 1=On;r/w;;
P3;Speed;12;2329H;int32;Hz;0.01;;;;;r;output_frequency;4
"""
TABLE_DAMAGES = (
    ("0=Off; 1=On", '"0=Off; 1=On"'), ("rw;accel", "x;accel"), ("Ramp", ""),
    ("0,1;0,1", "0,1;0,15"),
    ("0,1;0,1", "0,1;abc"), (";0,1;0,1", ";0;0,1"), ("9001", "10 * number"), ("2329H", "0x2g"),
    ("code;", "cod;"), ("code;name", "code;code"), ("code;", ""),
    ("quantity;function", "quantity;"),
    (";4\n", ";5\n"), ("P3;Speed", "\n;;;\nP3;Speed"), ("rw;accel", "R;accel"), ("999.9", "1e99"),
)  # fmt: skip


def set_files() -> Iterator[str]:
    profile = whole()
    text = dump_set(profile, OWN_SET)
    yield text
    for old, new in (("", ""), *SET_DAMAGES):
        damaged = text.replace(old, new, 1)
        assert old in text
        try:
            read = set_file.load_set(damaged, "a.set", lambda _: profile)
        except Exception as error:
            yield f"{old} -> {new}: {type(error).__name__}: {error}"
            continue
        changed = {c: r for c, r in read.raws.items() if HELD.get(c) != r}
        yield f"{old} -> {new}: {changed} {sorted(set(HELD) - set(read.raws))} {short(read.absent)}"
        yield f"  {read.unknown} {read.notes} {sorted(read.lossy)} {read.lines.get('ACCE')}"


def restoring() -> Iterator[str]:
    profile = whole()
    source = ParameterSet(HEAD, OTHER, notes={"CORR": "rounded"}, lossy=frozenset({"CORR"}))
    other_type = ParameterSet(HEAD, {**OTHER, "TYPE": 1, "CORR": 9, "GONE": 1})
    held = Held(HELD, {"ANIN": "exception 2", "LOW": "no reply"}, ("SLT1",), "EXFAN-22")
    choices = (Options(), Options(True, True), Options(confirmed=frozenset({"TOUT", "PIDF"})),
               Options(rating=True, rounded=True))  # fmt: skip
    for own, options in product((source, other_type), choices):
        plan = plan_restore(profile, held, own, profile, options)
        yield f"{short(options)}: {plan.same_rating} {plan.needs_stop} {plan.across}"
        for item in plan.items:
            yield f"  {item}"
        yield f"  {[(edit.code, edit.old, edit.new, edit.text) for edit in plan.edits]}"


def sharing() -> Iterator[str]:
    profile = whole()
    sets = [OWN_SET, ParameterSet(HEAD, {**HELD, "CORR": 7, "INCR": 0}), ParameterSet(HEAD, HELD)]
    shared, rest = recipes.split_sets(profile, sets)
    yield f"{short(shared)}"
    for each in rest:
        yield f"{short(each)}"
    yield recipes.dump_recipes([(1, "a", "m.set", "d.set"), (2, 'b"', "", "e\ud800")])
    for code in HELD:
        yield f"{code}: {recipes.belongs_to_drive(profile, code)}"
    now = SetHead("example-fan", identity={"reference": "EXFAN-11", "version": "1.3"})
    for head in (HEAD, now, SetHead("other"), SetHead("example-fan")):
        source = ParameterSet(head, HELD)
        yield f"{replacement.is_of_another_drive(now, head)}"
        yield f"  {result(replacement.identity_lines, profile, now, OTHER, profile, source)}"
        yield f"  {result(replacement.identity_lines, profile, HEAD, HELD, profile, source)}"
    counted = replacement.factory_count(profile, list(HELD), HELD)
    yield f"{counted} {counted.text} {replacement.factory_count(profile, HELD, OTHER).text}"


def tables() -> Iterator[str]:
    right = TABLE.replace(*TABLE_DAMAGES[0])
    yield result(profile_from_table, right, "Own", "t.csv")
    yield profile_from_table(right, "own", "t.csv")
    for old, new in TABLE_DAMAGES[1:]:
        damaged = right.replace(old, new, 1)
        assert damaged != right
        found = result(profile_from_table, damaged, "own", "t.csv")
        yield f"{old} -> {new}: {found.partition('[[parameters]]')[2][:330] or found}"
    commas = result(profile_from_table, 'code,name,access\nA,"x, y",r\nB,b\n', "own", "t.csv")
    yield commas.partition("[[parameters]]")[2]
    yield result(profile_from_table, "code\tname\n", "own", "t.csv")
    yield result(profile_from_table, 'code,name\nA,"', "own", "t.csv")


def blocks() -> Iterator[str]:
    profile = whole()
    [block] = profile.data.blocks
    timing = WireTiming()
    plans = [assignment.Assignment(block, raws) for raws in ((0, 0), (101, 0), (0, 228), (101, 102),
             (211, 101), (110, 0), (999, 100), (101, 101))]  # fmt: skip
    for plan in plans:
        yield f"{plan.raws}: {plan.length} {plan.slots} {wire_cost.span(plan)}"
        yield f"  {short(slot_rules.assignment_problems(profile, plan))}"
        yield f"  {[assignment.describe(profile, block, raw) for raw in plan.raws]}"
        yield f"  {short(assignment.steps({'SLT1': 101, 'SLT2': 0}, plan))}"
        yield f"  {short(assignment.slot_changes({'SLT1': 101}, plan))}"
        yield f"  {plan.cleared(0).raws} {plan.moved(0, 1).raws} {plan.with_raw(1, 5).raws}"
        yield f"  {wire_cost.block_request(profile, 3, plan, None).hex()}"
        yield f"  {wire_cost.block_request(profile, 3, None, plan, (7,)).hex()}"
        yield f"  {wire_cost.microseconds(profile, timing, plan, None)}"
        yield f"  {wire_cost.microseconds(profile, timing, None, plan)}"
        yield f"  {wire_cost.reach(profile, plan, ('FOUT', 'CORR'))}"
        slots = assignment.slots_of([plan])
        codes = ["FOUT", "CORR", "TRIP"]
        yield f"  {slots} {short(wire_cost.saving(profile, codes, timing, {}, slots))}"
    for code in ("FOUT", "HOUR", "FLDA", "ANIN", "SECR", "SLT1", "CTRL"):
        yield f"{code}: {slot_rules.reason_against(profile, block, profile[code])}"
        yield f"  {result(picking.pick, profile, plans[0], 1, code)}"
    for text in ("none", "16#65", "101", "gone", "70000", ""):
        yield f"{text!r}: {result(picking.raw_named, profile, block, text)}"
        yield f"  {[p.code for p in picking.choices(profile, block, text)][:6]}"
        yield f"  {result(user_words.word_named, profile, text)}"
    for text in ("hex", "signed", "x"):
        yield f"{text}: {result(user_words.format_named, text)}"
    yield f"{short(wire_cost.stretches(profile, ['FOUT', 'CORR', 'TRIP', 'LOW'], timing))}"
    for held in ({"SLT1": 0x10065, "SLT2": 228, "FOUT": 3}, {"SLT1": 101}):
        yield f"{held}: {short(assignment.assignment(block, held))}"
    other = assignment.Assignment(block, (1, 2))
    yield f"{[other.moved(place, step).raws for place in (-1, 0, 1, 2) for step in (-1, 0, 1)]}"
    yield f"{assignment.has_blocks(profile)} {short(assignment.empty(block))}"
    yield f"{short(assignment.factory(profile, block))} {assignment.describe(profile, block, None)}"
    for slot in ("SLT1", " slt2 ", "SLT3", ""):
        yield f"{slot!r}: {result(assignment.place_of, profile, slot)}"
    yield assignment.no_blocks(profile)
    for most in (1, 2):
        functions = [
            structs.replace(function, max_read=most) for function in profile.data.functions
        ]
        data = structs.replace(profile.data, functions=functions, blocks=[])
        yield f"{most}: {assignment.no_blocks(Profile(data))}"
        yield f"  {result(assignment.place_of, Profile(data), 'SLT1')}"
    text = file.dump_blocks(profile, [plans[1]], "a note")
    yield text
    for old, new in (("", ""), ('"FOUT"', '"GONE"'), ('"FOUT"', "70000"), ('"FOUT"', "true"),
                     ("SLT1", "SLT9"), ('SLT2 = "none"\n', ""), ("slots = 2", "slots = 3"),
                     ("[scan]", "[scam]"), ("format = 1", "format = 9"), ("[end]", "[en"),
                     ('"example-fan"', '"fan"'), ("[end]", "[ende]")):  # fmt: skip
        assert old in text, old
        yield f"{old} -> {new}: {result(file.load_blocks, text.replace(old, new, 1), 'b', profile)}"


def plans() -> Iterator[str]:
    profile, chance = whole(), random.Random(32)
    codes = [parameter.code for parameter in profile.parameters if parameter.access != "w"]
    slow = WireTiming(0.001, 0.0035, 0.02)
    for number in range(40):
        chosen = chance.sample(codes, chance.randint(1, 12))
        timing = slow if number % 2 else WireTiming()
        lost = chance.sample(codes, 3) if number % 3 == 0 else []
        slots = {"SLT1": 101, "SLT2": 228} if number % 4 == 0 else {}
        plan = plan_reads(profile, chosen, timing, slots, lost)
        reads = [(read.function, read.address, read.count) for read in plan.requests]
        yield f"{plan.microseconds} {reads} {short(plan.checks)}"


SECTIONS = (set_files, restoring, sharing, tables, blocks, plans)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_files_and_plans_of_a_whole_profile_are_the_recorded_ones(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
