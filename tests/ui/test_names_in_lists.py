"""Names in lists, for every family and size: none cut while there is room, no two alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest

from tests.sweeps import kept
from tui.drive.blocks.picking import choices, raw_of
from tui.drive.control_source import source_changes
from tui.drive.profile import library
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.settings.edits import Edit, Edits
from tui.drive.settings.selection import Choice, FilterId, chosen_codes, group_order, rows
from tui.screens.blocks.view import table_lines
from tui.screens.choosing import AROUND_PALETTE, WIDEST_PALETTE, action_lines
from tui.screens.command.teaching import teach_lines
from tui.screens.control.view import change_lines, source_row
from tui.screens.dialogs.pick_parameter import (
    AROUND,
    BESIDE_NAME,
    LISTED_MOST,
    WIDEST,
    pick_lines,
)
from tui.screens.faults.doctor import (
    CODE_WIDTH,
    LEAST_NOW,
    LEAST_TRIP,
    WIDEST_ROW,
    doctor_lines,
    value_rows,
)
from tui.screens.faults.doctor_view import DoctorView
from tui.screens.faults.parts import LABEL
from tui.screens.faults.view import stored_lines
from tui.screens.keys.finding import find
from tui.screens.keys.table import SCREENS
from tui.screens.monitor.arrange import VALUE_COLUMN
from tui.screens.monitor.assembly import LABELS, other_values, value_labels
from tui.screens.parameters.parameter_list import FIRST, LAST, ParameterList, group_lines
from tui.screens.parameters.screen import NARROW, WIDE
from tui.screens.parameters.table_view import (
    LEAST_NAME,
    LEAST_STAGED_NAME,
    head_line,
    items_of,
    layout_of,
    row_line,
)
from tui.session.settings.editor import Editor
from tui.widgets.drawing import DENIES, fitted_names

from . import fakes
from .test_block_pictures import desk_on, view_of
from .test_parameter_pictures import still_editor

FAMILIES = [listing.id for listing in library.listings()]
WIDTHS = {"60x16": 60, "80x24": 80, "120x40": 120, "200x60": 200}
SEARCHES = ("ramp", "stt", "reaction", "input", "fault", "speed", "vitesse", "timeout", "")


def table_width(width: int) -> int:
    """Cells of the list of Parameters, next to the groups."""
    return width if width < NARROW else width - (27 if width >= WIDE else 20)


def editor_of_family(profile: Profile, *, staged: bool = False) -> Editor:
    """An editor on a drive that holds a value everywhere."""
    raws = {p.code: p.min or 0 for p in profile.parameters if p.access != "w"}
    console = fakes.console_of(fakes.snapshot_of(profile, raws), family=profile.id)
    editor = still_editor(console, lambda: None)
    for code, raw in raws.items():
        console.session.image.confirm(code, raw, fakes.NOW)
    if staged:
        setting = next(p for p in profile.parameters if p.access != "r" and p.max)
        editor.staging.edits = Edits((Edit(setting.code, "1", 0, 1, "1", "0"),))
    return editor


def lists_of(editor: Editor) -> Iterator[list[str]]:
    """The codes of every list that Parameters can show."""
    facts, profile = editor.facts, editor.session.profile
    for group in profile.groups:
        yield chosen_codes(facts, Choice(group=group))
    filters: tuple[FilterId, ...] = (*FIRST, *LAST, "start-up")
    for name in filters:
        yield chosen_codes(facts, Choice(name))
    for search in SEARCHES:
        yield rows(facts, "all", search)


def alike(texts: Sequence[str]) -> list[str]:
    return sorted({text for text in texts if texts.count(text) > 1})


@pytest.mark.parametrize("family", kept(FAMILIES, *(f for f in FAMILIES if f != "atv71")))
@pytest.mark.parametrize("staged", kept([False, True], True))
def test_parameters_and_search_results(family: str, staged: bool) -> None:
    editor = editor_of_family(library.load(family), staged=staged)
    profile = editor.session.profile
    for codes in lists_of(editor):
        items = items_of(editor, codes, headings=False)
        for width in map(table_width, WIDTHS.values()):
            layout = layout_of(editor, items, width)
            columns = layout.columns
            texts = [row_line(editor, i, layout, width, chosen=False).plain for i in items]
            start = 1 + columns.code + columns.number
            end = start + columns.name
            if any("…" in text[end : end + columns.value] for text in texts):
                # a value is cut only if the names have no cell more than they need
                least = LEAST_STAGED_NAME + 1 if columns.staged else LEAST_NAME
                assert columns.name <= least, (codes[0], width)
                assert not columns.other, (codes[0], width)
            names = [text[start : start + columns.name].rstrip() for text in texts]
            assert alike(names) == [], (codes[0], width)
            assert max(map(len, texts), default=0) <= width
            head = head_line(columns, "Factory").plain.rstrip()
            assert len(head) <= width
            cut = [n for n, code in zip(names, codes, strict=True) if n != profile[code].name]
            if not cut:
                continue
            # the details have the factory value: its column gives way to the names
            assert "Staged" not in head or "Factory" not in head
            assert columns.name >= 17, (codes[0], width)
            assert columns.taken + columns.name == width
            ends = [
                at + len(title)
                for title in ("Value", "Staged", "Factory")
                if (at := head.find(title)) >= 0
            ]
            cells = [{text[end - 3 : end].strip() for text in texts} for end in ends]
            assert all(column != {""} for column in cells), (codes[0], width, head)


def test_shortened_name_keeps_what_tells_it_from_others() -> None:
    names = (
        "Rounding at the start of acceleration",
        "Rounding at the end of acceleration",
        "Reaction to a Modbus fault",
        "Level",
    )
    fitted = fitted_names(names, 24)
    assert "start" in fitted[names[0]]
    assert "end" in fitted[names[1]]
    assert fitted[names[2]] == "Reaction to Modbus fault"
    assert fitted[names[3]] == "Level"
    assert max(map(len, fitted.values())) <= 24
    assert fitted_names(names, 40) == {name: name for name in names}


def test_names_without_room_stay_apart() -> None:
    names = tuple(f"Preset speed {number} of the second motor" for number in range(1, 17))
    for width in (8, 12, 20, 30):
        fitted = fitted_names(names, width)
        assert len(set(fitted.values())) == len(names), width
        assert max(map(len, fitted.values())) <= width


@pytest.mark.parametrize("width", [24, 28])
def test_shortened_name_keeps_the_word_that_denies_it(width: int) -> None:
    """'Pulse threshold…run command' meant the opposite of the whole name."""
    for family in FAMILIES:
        profile = library.load(family)
        for group in profile.groups:
            names = tuple(p.name for p in profile.parameters if p.group == group)
            fitted = fitted_names(names, width)
            for name in names:
                assert len(DENIES.findall(name)) == len(DENIES.findall(fitted[name])), fitted[name]


@pytest.mark.parametrize("family", FAMILIES)
def test_values_of_a_fault(family: str) -> None:
    profile = library.load(family)
    for fault in profile.data.faults.codes:
        view = DoctorView(profile, fault, True, None, {}, fakes.NOW)
        for width in WIDTHS.values():
            lines = [line.plain for line in value_rows(view, width)[1:]]
            room = min(width, WIDEST_ROW) - LEAST_TRIP - LEAST_NOW
            assert alike([line[2 + CODE_WIDTH : room].strip() for line in lines]) == [], width


@pytest.mark.parametrize("family", FAMILIES)
def test_values_and_configurations_to_choose(family: str) -> None:
    profile = library.load(family)
    for parameter in profile.parameters:
        assert alike([*profile.names(parameter).values()]) == [], parameter.code
    names = [source_row(s, active=True).plain for s in profile.data.control_sources]
    assert alike(names) == []
    assert max(map(len, names), default=0) <= min(WIDTHS.values())


@pytest.mark.parametrize("family", FAMILIES)
def test_groups_of_parameters(family: str) -> None:
    profile = library.load(family)
    listed = ParameterList(groups=group_order(profile))
    entries = listed.entries(editor_of_family(profile).facts)
    for width in (19, 26):
        lines = group_lines(entries, entries[0].choice, width, len(entries))
        assert alike([line.plain.strip() for line in lines]) == [], width
        assert {line.cell_len for line in lines} == {width}
    assert [line.plain.strip() for line in lines] == [entry.label for entry in entries]


@pytest.mark.parametrize("family", FAMILIES)
def test_pick_list_of_a_slot(family: str) -> None:
    profile = library.load(family)
    for block in profile.data.blocks:
        for search in SEARCHES:
            parameters = choices(profile, block, search)[:LISTED_MOST]
            for screen in WIDTHS.values():
                width = min(WIDEST, screen) - AROUND
                texts = [line.plain for line in pick_lines(parameters, width)]
                assert max(map(len, texts), default=0) <= width
                assert alike([text[11:-17] for text in texts]) == [], (search, screen)
                longest = max((len(p.name) for p in parameters), default=0)
                if longest <= width - BESIDE_NAME:
                    assert [
                        t[11 : 11 + len(p.name)] for t, p in zip(texts, parameters, strict=True)
                    ] == [p.name for p in parameters]


def test_actions_of_the_palette() -> None:
    for screen in SCREENS:
        for typed in ("", "a", "w", "s"):
            found = find(typed, screen.name)
            for width in WIDTHS.values():
                cells = min(WIDEST_PALETTE, width) - AROUND_PALETTE
                texts = [line.plain for line in action_lines(found, cells)]
                assert {len(text) for text in texts} <= {cells}
                assert alike(texts) == [], (screen.name, typed, width)


@pytest.mark.parametrize("family", FAMILIES)
def test_words_to_teach(family: str) -> None:
    profile = library.load(family)
    console = fakes.console_of(None, family=family)
    codes = [p.code for p in profile.parameters if p.access == "r" and not p.bits]
    for width in (54, 64):
        texts = [line.plain for line in teach_lines(console, codes, width)]
        assert alike([text[9:] for text in texts]) == [], width
        assert max(map(len, texts)) <= width


@pytest.mark.parametrize("family", FAMILIES)
def test_changes_of_the_command_source(family: str) -> None:
    profile = library.load(family)
    for source in profile.data.control_sources:
        found = source_changes(profile, source, {})
        for width in WIDTHS.values():
            texts = [line.plain for line in change_lines(profile, found, width)]
            assert alike([text[10:] for text in texts]) == []
            assert max(map(len, texts)) <= width


@pytest.mark.parametrize("family", ["atv21", "atv71"])
def test_slots_of_a_block(family: str) -> None:
    block_editor = desk_on(family)
    profile = block_editor.session.profile
    for block in block_editor.proposals.blocks:
        longest = sorted(choices(profile, block), key=lambda p: -len(p.name))[: len(block.slots)]
        raws = tuple(raw_of(profile, block, parameter) for parameter in longest)
        raws += (0,) * (len(block.slots) - len(raws))
        block_editor.views[block.id] = view_of(block_editor.session, block, raws, {})
        for width in (40, 55, 60, 100):
            lines = [
                line.plain for line in table_lines(block_editor, block, width, None, double=True)
            ]
            names = [line.split("  ")[-1] for line in lines[2::2] if line.strip()]
            assert len(names) == len(longest)
            assert alike(names) == [], width
            assert max(map(len, lines)) <= width
        assert names == [parameter.name for parameter in longest]


@pytest.mark.parametrize("family", FAMILIES)
def test_history_of_faults(family: str) -> None:
    profile = library.load(family)
    faults = profile.data.faults
    history = [code for code in faults.history if profile.get(code) is not None]
    known = [fault for fault in faults.codes if fault.raw != faults.none]
    for start in range(0, len(known), max(1, len(history))):
        some = known[start : start + len(history)]
        raws = {code: fault.raw for code, fault in zip(history, some, strict=False)}
        readings = fakes.readings_of(profile, raws, fakes.NOW)
        view = DoctorView(profile, None, False, None, readings, fakes.NOW)
        for width in WIDTHS.values():
            lines = [line.plain for line in doctor_lines(view, width, 40)]
            names = [line[LABEL + 5 :].rstrip() for line in lines[-len(some) :]]
            assert alike(names) == [], width
            if width >= 80:
                assert names == [f"{fault.code} {fault.name}" for fault in some]


@pytest.mark.parametrize("family", FAMILIES)
def test_values_stored_with_a_fault(family: str) -> None:
    profile = library.load(family)
    for codes in filter(None, profile.data.faults.stored):
        raws = dict.fromkeys(codes, 65535)
        readings = fakes.readings_of(profile, raws, fakes.NOW)
        for width in (30, 40, 52):
            lines = [line.plain for line in stored_lines(profile, codes, readings, width)]
            assert alike([line[7:] for line in lines]) == [], width
            assert max(map(len, lines)) <= width


@pytest.mark.parametrize("family", FAMILIES)
def test_values_of_monitor(family: str) -> None:
    profile = library.load(family)
    for wide in (False, True):
        values = other_values(profile, wide=wide)
        for cells in range(19, 60):
            for barred in (False, True):
                labels = value_labels(profile, values, cells, barred)
                assert alike(labels) == [], cells
                assert len({len(label) for label in labels}) <= 1


@pytest.mark.parametrize("family", FAMILIES)
def test_values_of_monitor_in_narrow_columns_have_whole_names(family: str) -> None:
    profile = library.load(family)
    known = [
        value
        for value in other_values(profile, wide=False)
        if profile[value.parameter].quantity in LABELS and is_verified(profile[value.parameter])
    ]
    labels = value_labels(profile, known, VALUE_COLUMN, barred=False)
    assert not [label for label in labels if "…" in label]
