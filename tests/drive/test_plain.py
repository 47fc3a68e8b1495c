"""Control characters as symbols: the name of a drive must not control the terminal."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.drive.plain import commands, escaped_toml, markdown_table, plain


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("MACHINE 4 · µ → 30 °C", "MACHINE 4 · µ → 30 °C"),
        ("\x1b]0;x\x07[red]", "␛]0;x␇[red]"),
        ("a\nb\r\tc\0\x7f", "a␊b␍␉c␀␡"),
        ("\x9b31m", "\ufffd31m"),
        ("safe\u202egpj.exe", "safe\ufffdgpj.exe"),
        ("broken \udcff name", "broken \ufffd name"),
        ("one\u2028two", "one\ufffdtwo"),
    ],
)
def test_control_characters_are_replaced_by_symbols(text: str, shown: str) -> None:
    assert plain(text) == shown


def test_line_feeds_are_kept_on_request() -> None:
    assert plain("one\ntwo\x1b[2J", lines=True) == "one\ntwo␛[2J"


@given(st.text(st.characters()))
def test_replacement_keeps_the_length_and_leaves_no_control_character(text: str) -> None:
    shown = plain(text)
    assert len(shown) == len(text)
    assert not any(commands(character) for character in shown)
    assert plain(shown) == shown
    shown.encode("utf-8")


def test_text_that_no_file_can_hold_is_written_with_a_question_mark() -> None:
    assert escaped_toml('a"\x1b\udcff') == '"a\\"\\u001b?"'


def test_cell_of_markdown_ends_neither_its_column_nor_its_row() -> None:
    assert markdown_table(("a|b", "c"), [("1\n2", "\x1b|")]) == [
        r"| a\|b | c |",
        "|---|---|",
        r"| 1 2 | ␛\| |",
    ]
