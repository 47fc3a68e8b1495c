"""All that the pure functions of a drive return for one invented profile, as text.

`whole_values.txt` has a section for each subject. Its lines name what was passed, and the result
or the error. Read a changed line as a sentence of its own, and change the file only if it is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from decimal import Decimal
from functools import cache
from pathlib import Path

import pytest

from tests.recorded import result, sections, short
from tui.drive import (
    causes,
    channel,
    chart,
    command_blocked,
    control_source,
    fault_reset,
    foreign_write,
    hints,
    model,
    orders,
    read_plan,
    shown,
    signal_path,
    taught_profile,
    values,
    words,
)  # fmt: skip
from tui.drive.errors import DriveError
from tui.drive.family_page import family_page, page_lines
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.rules.meanings import PORT_BAUDS
from tui.drive.settings import compare, factory, in_force, limits, selection, writable
from tui.drive.settings.edits import Edits, command_settings, commander_changes, consequences

HERE = Path(__file__).parent
TEXTS = HERE / "whole_values.txt"
HELD = {
    "STAT": 0x0107, "FOUT": -251, "TRIP": 7, "TRP1": 1, "CHST": 0x11, "TYPE": 2, "TEMP": 95,
    "HOUR": 70000, "POWR": 123, "CTRL": 15, "FREF": 300, "SREF": 1450, "CHAN": 1, "KEYP": 0,
    "LOW": 50, "HIGH": 500, "POLE": 4, "RATE": 48, "THER": 50, "INCR": 1, "ACCE": 30, "FULL": 80,
    "PART": 10000, "PIDF": 12, "BFR": 0, "NOMF": 500, "FLDA": 3, "FLDB": 2, "TOUT": 100,
    "TRCT": 1, "ADDR": 1, "BAUD": 2, "FORM": 0, "SECR": 1, "CORR": -5, "ENAB": 3,
}  # fmt: skip
OTHER = {
    **HELD, "CHAN": 0, "KEYP": 1, "CHST": 0x22, "STAT": 0x0408, "INCR": 0, "FULL": 0, "RATE": 0,
    "BFR": 1, "LOW": 500, "HIGH": 100, "TRIP": 0, "TRCT": 0, "TOUT": 0,
}  # fmt: skip
STATES = {"held": HELD, "other": OTHER, "nothing": {}}
TYPED = (
    "0", "1", "3.25", "-5", "12,5 ", "70000", "1e3", "2 min", "500ms", "3 kW", "16#0F", "0xFFFF8",
    "16#x", "modbus", "off", "12.34?", "nan", "1" * 40, "",
)  # fmt: skip


@cache
def whole() -> Profile:
    return library.load_file(HERE / "whole.toml")


def parameters() -> Iterator[str]:
    profile = whole()
    for own in profile.parameters:
        numbers = values.type_range, values.raw_range, values.possible_decimals, words.word_count
        is_what = words.is_field, words.is_signed_type, values.is_enumeration
        yield f"{own.code}: {[call(own) for call in (*numbers, *is_what)]}"
        for name, raws in STATES.items():
            low, high = values.raw_range(own)
            texts = [
                shown.shown(profile, own, raw, raws).display
                for raw in dict.fromkeys((0, 1, 7, low, high, raws.get(own.code, 0)))
            ]
            typed = [shown.typed_text(profile, own, raw, raws) for raw in (1, high)]
            yield f"  {name}: {texts} {typed} {shown.number_of(profile, own, 5, raws)}"
        absent = own.scale_source or "INCR"
        yield f"  {shown.shown_text(profile, own, 12, HELD, (absent,))} {shown.depends_on(own)}"
        for raw in (0, 1, 300, -1, 70000):
            yield f"  {raw}: {result(words.to_words, own, raw, 0x1234)}"
            yield f"  {words.hexadecimal(own, raw)}"
        yield f"  {result(words.to_words, own, 1)} {words.from_words(own, (0x8234, 0x0001))}"


def typed() -> Iterator[str]:
    profile = whole()
    for code in ("FOUT", "TEMP", "HOUR", "POWR", "CHAN", "THER", "ACCE", "PART", "PIDF", "FLDA",
                 "FLDB", "TOUT", "CORR", "ENAB", "POLE"):  # fmt: skip
        for text in TYPED:
            yield f"{code}"
            yield f"{text!r}: {result(shown.raw_of_text, profile, profile[code], text, HELD)}"
    for code in ("ACCE", "PART", "PIDF", "THER"):
        yield f"{code} 12 {result(shown.raw_of_text, profile, profile[code], '12', {})}"


def writing() -> Iterator[str]:
    profile = whole()
    for own in profile.parameters:
        yield f"{own.code}: {writable.marks(profile, own)}"
        is_what = (
            writable.is_order, writable.is_setting, writable.needs_standstill, writable.cuts_line,
            writable.waits_for_reset,
        )  # fmt: skip
        yield f"  {[call(profile, own) for call in is_what]}"
        yield f"  {short(writable.slot_of(profile, own.code))}"
        for state in (None, "running", "ready"):
            yield f"  {state}: {result(writable.write_refusal, profile, own, state)}"
        for raw in (0, 1):
            yield f"  {raw}: {writable.warning(profile, own, raw)}"
            yield f"  {writable.never_set(profile, own, raw)}"
        for name, raws in STATES.items():
            limit = in_force.limits_in_force(profile, own, raws)
            yield f"  {name}: {limit and limit.text}"
            yield f"  {short(factory.factory_value(profile, own, raws))}"
            yield f"    {factory.not_factory(profile, own, raws)} {limits.limits_are_sure(own)}"
        yield f"  {factory.factory_sources(own)} {short(limits.limit_sources(profile, [own.code]))}"


def edits() -> Iterator[str]:
    profile = whole()
    staged = Edits()
    for code, text in (
        ("ACCE", "4.56"), ("INCR", "0.01"), ("THER", "8"), ("RATE", "4"), ("HIGH", "4"),
        ("LOW", "9"), ("CHAN", "Terminals"), ("KEYP", "On"), ("TOUT", "off"), ("TRCT", "Ignore"),
        ("POLE", "4"), ("CORR", "0.04"), ("CORR", "0.55"), ("BFR", "60 Hz"), ("NOMF", "60"),
        ("SECR", "1"), ("GONE", "1"), ("FOUT", "1"), ("FULL", "50"), ("PART", "60"),
    ):  # fmt: skip
        before = staged
        try:
            staged = staged.stage(profile, code, text, HELD)
        except DriveError as error:
            yield f"{code} {text}: {error}"
            continue
        last = next(edit for edit in staged.requested if edit.code == profile[code].code)
        yield f"{code} {text}: {short(last)} {last.loss!r} {last.remark!r} {code in staged}"
        yield f"  {in_force.limit_passed(profile, before, staged, HELD)!r}"
        for problem in limits.edit_problems(profile, staged, HELD).items():
            yield f"  {problem}"
    yield f"{commander_changes(profile, staged)} {sorted(command_settings(profile))}"
    yield from consequences(profile, Edits().stage(profile, "INCR", "0.01", HELD), HELD)
    for edit in staged:
        based = [
            limits.builds_on(profile, edit, missed, staged, HELD)
            for missed in ({"INCR"}, {"RATE"}, {"HIGH"}, {"LOW"}, {"BFR"}, {"THER"}, {"FULL"}, ())
        ]
        yield f"{edit.code}: {based}"
    for code in ("INCR", "RATE", "FULL", "CHAN"):
        left = staged.undo(code, profile, HELD)
        yield f"without {code}: {[(edit.code, edit.old, edit.new, edit.text) for edit in left]}"
    now = staged.now(profile, OTHER)
    yield f"now: {[(edit.code, edit.old, edit.new, edit.old_text, edit.text) for edit in now]}"


def selecting() -> Iterator[str]:
    profile = whole()
    facts = selection.FilterContext(
        profile, HELD, Edits().stage(profile, "ACCE", "9", HELD), ("LOW",), ("KEYP",),
        ("CORR", "GONE", "ADDR"), OTHER,
    )  # fmt: skip
    for chosen in selection.FILTERS:
        yield f"{chosen}: {selection.rows(facts, chosen)}"
    for text in ("speed", "acc", "16#00d3", "40211", "211", "hig", "motor current", "ress",
                 "line", "time accel", "modbus", "set all", "zzz", "  "):  # fmt: skip
        yield f"{text!r}: {selection.rows(facts, 'all', text)}"
    yield f"{selection.group_order(profile)} {selection.home_group(profile)}"


def comparing() -> Iterator[str]:
    profile = whole()
    sides = [
        compare.Side("a|b", HELD, {"ENAB": "not read"}, {"POLE": "by type"}, {"ACCE": "doubted"}),
        compare.Side("other", {**OTHER, "ACCE": 35, "CORR": 0}, left={"ADDR": "line setting"}),
        compare.Side("factory", {"ACCE": 30, "POLE": 4}),
    ]
    for a, b in ((0, 1), (0, 2), (1, 0), (0, 0)):
        for all_rows in (False, True):
            rows = compare.compare_settings(profile, sides[a], sides[b], all_rows=all_rows)
            for form in ("text", "markdown", "csv") if not all_rows or a else ("text",):
                yield compare.rows_text(rows, (sides[a].label, sides[b].label), form)


def states() -> Iterator[str]:
    profile = whole()
    own = profile.data.charts[0]
    for word in range(0x0A):
        yield f"{word}: {chart.state_of(own, {'STAT': word}).id}"
    for number, raws in enumerate((HELD, OTHER, {}, {**HELD, "STAT": 0}, {**OTHER, "STAT": 1})):
        yield f"{number}: {short(chart.read_chart(profile, raws))}"
        yield f"  {result(channel.command_channel, profile, raws)}"
        yield f"  {result(channel.reference_channel, profile, raws)}"
        yield f"  {result(control_source.source_in_force, profile, raws)}"
        for source in profile.data.control_sources:
            yield f"  {source.id}: {short(control_source.source_changes(profile, source, raws))}"
        for carries in ("command", "reference"):
            state = signal_path.path_state(profile, carries, raws)
            yield f"  {carries}: {short(state)}"
            if state is not None:
                ways = signal_path.ways_to_line(profile, state, raws)
                yield f"    {signal_path.is_certain(state)} {[way.text for way in ways]}"
        for id in ("forward", "reverse", "stop", "freewheel", "reset", "quick-stop", "hand-back"):
            yield f"  {id}: {result(command_blocked.blocked_reason, profile, own, id, raws)}"
            yield f"    {result(command_blocked.state_refusal, profile, own, id, raws)}"
            yield f"    {result(orders.choose, own, id, raws)}"
            yield f"    {result(orders.nearest_stop, own, id)}"
            yield f"    {result(orders.locked_by, own, id, raws)}"
            yield f"    {result(orders.unmet, own, id, raws)}"
        yield f"  {result(fault_reset.reset_follows, profile, raws, {})}"
        yield f"  {fault_reset.not_in_command(profile, raws)} {hints.reset_ready(profile, raws)}"
        yield f"  {fault_reset.command_holder(profile, raws)}"
        yield f"  {fault_reset.closed_inputs(profile, raws)}"
        yield f"  {hints.alarms_on(profile, raws)} {result(model.model_of, profile, raws)}"
    for start in ("off", "ready", "running", "fault"):
        for goal in ("off", "ready", "running", "fault"):
            yield f"{start} to {goal}: {result(orders.walk, own, start, goal)}"
    for order in own.orders:
        yield f"{order.id}: {result(orders.with_options, own, order, {'CTRL': 0x0107})}"
        yield f"  {result(orders.last_word, own, order)}"
        yield f"  {orders.order_target(profile, own, order).code}"
        yield f"  {orders.follows_from(own, order.id)} {orders.stop_conditions(own, order.id)}"
    yield f"{orders.deciding_codes(profile)} {orders.optional_bits(own, 'CTRL')}"
    yield f"{chart.watched_codes(profile)} {channel.channel_codes(profile)}"


def writes_of_others() -> Iterator[str]:
    profile = whole()
    for sent in ({200: 15}, {200: 7}, {200: 31}, {200: 0x010F}, {200: 0x0107}, {200: 0}, {200: 6},
                 {200: 128}, {201: 300}, {202: 5}, {200: 15, 201: 0xFE0C}, {203: 1}, {224: 2},
                 {220: 1}, {227: 1}, {211: 99}, {110: 1}, {217: 3}, {999: 1}):  # fmt: skip
        found = foreign_write.classify_words(profile, sent, HELD)
        yield f"{sent}: {[(w.kind.name, [p.code for p in w.parameters]) for w in found]}"
        yield f"  {foreign_write.starts_by(profile, found)}"
        yield f"  {foreign_write.stop_deciding_codes(profile, sent)}"
        for word in found:
            for allowed in ((), ("all",), ("ACCE", "CHAN")):
                yield f"  {foreign_write.setting_refusal(profile, word, allowed)}"
            for parameter in word.parameters:
                yield f"  {foreign_write.value_refusal(profile, parameter, sent)}"
                for raws in STATES.values():
                    yield f"  {foreign_write.only_stops(profile, parameter, sent, raws)}"


def faults() -> Iterator[str]:
    profile = whole()
    for help_ in profile.data.faults.help:
        for known in (
            causes.KnownValues(HELD), causes.KnownValues(HELD, {"FOUT": 600}),
            causes.KnownValues({}, {}, {"FOUT": -600}), causes.KnownValues({"FOUT": 600}),
            causes.KnownValues(HELD, {"FOUT": 600}, {}, frozenset({"FOUT"})),
        ):  # fmt: skip
            for cause in causes.weigh(profile, help_, known):
                backing = [(found.text, found.basis, found.reason) for found in cause.evidence]
                yield f"{cause.text} {cause.verdict} {cause.weight} {backing} {cause.unknown}"
    yield f"{causes.values_at_trip(profile, HELD, 0, present=True)}"
    yield f"{[p.code for p in profile.parameters if causes.is_measured(profile, p)]}"


def reading() -> Iterator[str]:
    profile = whole()
    codes = [parameter.code for parameter in profile.parameters]
    plan = read_plan.plan_reads(profile, codes)
    for request in plan.requests:
        yield f"{short(request)}"
    yield f"{plan.microseconds} {result(read_plan.plan_reads, profile, ['GONE'])}"
    few = read_plan.plan_reads(profile, ["FOUT", "CORR", "HOUR", "ANIN"], unreadable=("CTRL",))
    yield f"{few.microseconds} {short(few.requests)}"


def teaching() -> Iterator[str]:
    profile = whole()
    for code in ("FOUT", "PIDF", "SLT1", "CTRL", "GONE", "CHAN"):
        yield f"{code}: {result(taught_profile.why_not_taught, profile, code)}"
    yield f"{taught_profile.teachable_codes(profile)}"


def page() -> Iterator[str]:
    for width in (60, 100):
        for line in page_lines(family_page(whole()), width):
            yield f"{line}"


def scales() -> Iterator[str]:
    for scale in ("0.1", "0.25", "0.0018311", "-0.1", "10", "0.00123"):
        own = Decimal(scale)
        for offset in ("0", "-50", "0.125"):
            numbers = [str(values.engineering(raw, own, offset)) for raw in (0, 1, -17, 32767)]
            yield f"{scale} {offset}: {values.decimals_of(own)} {numbers}"
    yield f"{sorted(PORT_BAUDS)}"
    for percent, rating in (("50", "4.8"), ("33.3", "100"), ("-12.5", "0.10")):
        yield f"{values.percent_of(Decimal(percent), Decimal(rating))}"


SECTIONS = (
    scales, parameters, typed, writing, edits, selecting, comparing, states, writes_of_others,
    faults, reading, teaching, page,
)  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_functions_return_what_is_recorded_for_a_whole_profile(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
