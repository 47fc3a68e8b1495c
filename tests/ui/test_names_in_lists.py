"""Names in lists, for every family and size: none cut while there is room, no two alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest

from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.settings.edits import Edit, Edits
from tui.drive.settings.selection import Choice, FilterId, chosen_codes, rows
from tui.screens.parameters.parameter_list import FIRST, LAST
from tui.screens.parameters.screen import NARROW, WIDE
from tui.screens.parameters.table_view import head_line, items_of, layout_of, row_line
from tui.session.settings.editor import Editor
from tui.widgets.drawing import fitted_names

from . import fakes
from .test_parameter_pictures import still_editor

FAMILIES = [listing.id for listing in library.listings()]
WIDTHS = {"60x16": 60, "80x24": 80, "120x40": 120, "200x60": 200}
SEARCHES = ("ramp", "stt", "reaction", "input", "fault", "speed", "vitesse", "timeout", "")


def table_width(width: int) -> int:
    """Cells of the list of Parameters, beside the groups."""
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


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("staged", [False, True])
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
            names = [text[start : start + columns.name].rstrip() for text in texts]
            assert alike(names) == [], (codes[0], width)
            assert max(map(len, texts), default=0) <= width
            head = head_line(columns, "Factory").plain.rstrip()
            assert len(head) <= width
            cut = [n for n, code in zip(names, codes, strict=True) if n != profile[code].name]
            if not cut:
                continue
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
