"""Abilities of a terminal by its environment, and replacements for missing ones."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.color import ColorSystem
from rich.segment import Segment
from rich.style import Style
from textual.color import Color

import tui
from tui.terminal.abilities import ASCII, UTF_8, Abilities, abilities_of, encoding_of
from tui.terminal.few_colors import (
    NO_SIGN,
    PLAIN_SIGNS,
    PlainSigns,
    in_encoding,
    in_sixteen,
    without_colors,
)
from tui.widgets import palette

LOCALES = [
    ({"LANG": "en_US.UTF-8"}, UTF_8),
    ({"LC_CTYPE": "UTF-8"}, UTF_8),
    ({"LANG": "de_DE.utf8@euro"}, UTF_8),
    ({"LANG": "en_US.UTF-8", "LC_ALL": "C"}, ASCII),
    ({"LANG": "C", "LC_CTYPE": "C.UTF-8"}, UTF_8),
    ({"LANG": "C"}, ASCII),
    ({"LANG": "POSIX"}, ASCII),
    ({"LANG": "", "LC_ALL": ""}, ASCII),
    ({}, ASCII),
    ({"LANG": "en_US.nonsense"}, ASCII),
    ({"LANG": "en_US.hex"}, ASCII),
]


@pytest.mark.parametrize(("environment", "encoding"), LOCALES)
def test_locale_sets_the_encoding(environment: dict[str, str], encoding: str) -> None:
    assert encoding_of(environment) == encoding


def test_latin_1_is_used_only_if_python_writes_it() -> None:
    environment = {"LANG": "fr_FR.ISO-8859-1"}
    assert encoding_of(environment, "iso-8859-1") == "iso8859-1"
    assert encoding_of(environment, "utf-8") == ASCII, "two bytes would be two signs there"


@pytest.mark.parametrize(("ascii", "encoding"), [(True, ASCII), (False, UTF_8)])
def test_ascii_option_overrides_the_locale(ascii: bool, encoding: str) -> None:
    for environment in ({"LANG": "en_US.UTF-8"}, {"LANG": "C"}):
        assert abilities_of(environment, ascii=ascii).encoding == encoding


COLORS = [
    ({"TERM": "xterm-256color"}, ColorSystem.EIGHT_BIT),
    ({"TERM": "xterm-256color", "COLORTERM": "truecolor"}, ColorSystem.TRUECOLOR),
    ({"TERM": "xterm-256color", "COLORTERM": "truecolor", "NO_COLOR": "1"}, None),
    ({"TERM": "xterm-256color", "NO_COLOR": ""}, ColorSystem.EIGHT_BIT),
    ({"TERM": "linux"}, ColorSystem.STANDARD),
    ({"TERM": "vt100"}, None),
    ({"TERM": "vt220"}, None),
    ({"TERM": "dumb"}, None),
    ({"TERM": "dumb", "COLORTERM": "truecolor"}, None),
    ({"TERM": ""}, None),
    ({}, None),
    ({"TERM": "nobody-256color"}, ColorSystem.EIGHT_BIT),
    ({"TERM": "nobody-knows"}, None),
]


@pytest.mark.parametrize(("environment", "colors"), COLORS)
def test_terminfo_sets_the_number_of_colors(
    environment: dict[str, str], colors: ColorSystem | None
) -> None:
    assert abilities_in(environment).colors == colors


@pytest.mark.parametrize("term", ["vt100", "nobody-knows", "dumb", "screen"])
def test_erasing_is_used_only_with_background_color_erase(term: str) -> None:
    assert not abilities_in({"TERM": term}).erases


def abilities_in(environment: dict[str, str]) -> Abilities:
    """Result in a separate process: terminfo is read once in each."""
    code = (
        "import sys, pickle; from tui.terminal.abilities import abilities_of;"
        f"sys.stdout.buffer.write(pickle.dumps(abilities_of({environment!r})))"
    )
    reported = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    found = pickle.loads(reported)
    assert isinstance(found, Abilities)
    return found


def test_every_symbol_has_an_ascii_replacement() -> None:
    drawn = {
        character
        for path in Path(tui.__file__).parent.rglob("*.py")
        for character in path.read_text("utf-8")
        if not character.isascii() and not "\u2400" <= character <= "\u2421"
    }
    assert [text for text in sorted(drawn) if in_encoding(text, ASCII) == NO_SIGN] == []
    assert all(cell_len(text) == len(PLAIN_SIGNS.get(text, " ")) for text in drawn)


@given(st.text(max_size=30))
def test_plain_text_is_ascii_of_the_same_width(text: str) -> None:
    (segment,) = PlainSigns(ASCII).apply([Segment(text)], Color(0, 0, 0))
    assert segment.text.isascii()
    assert cell_len(segment.text) == cell_len(text)


def test_latin_1_keeps_its_characters() -> None:
    assert in_encoding("µ ± ü · →", "iso8859-1") == "µ ± ü · >"


STYLES = [style for name, style in vars(palette).items() if isinstance(style, Style)]


@pytest.mark.parametrize("style", STYLES, ids=str)
def test_sixteen_colors_never_match_the_background(style: Style) -> None:
    shown = in_sixteen(Style(bgcolor=palette.GROUND) + style)
    assert shown.color is None or shown.color.number != shown.bgcolor.number  # type: ignore[union-attr]


def test_styles_without_colors_stay_visible() -> None:
    assert without_colors(palette.CURSOR).reverse
    assert without_colors(palette.FAULT_BLOCK).reverse
    assert without_colors(palette.ATTENTION_BLOCK).reverse
    assert not without_colors(Style(color=palette.TEXT, bgcolor=palette.SURFACE)).reverse
    grounds = {
        in_sixteen(Style(bgcolor=text)).bgcolor for text in (palette.GROUND, palette.SURFACE)
    }
    assert in_sixteen(palette.CURSOR).bgcolor not in grounds
    assert in_sixteen(palette.FAULT).color != in_sixteen(palette.ALARM).color
