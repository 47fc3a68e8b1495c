"""Rows of the command line, as lines and as tables."""

from __future__ import annotations

import ast
import io

import pytest
from rich.console import Console

from tests.sources import PACKAGE, modules, nodes_of
from tui.cli.shared.rows import Column, row_text, say_row, table_of, titled

COLUMNS = (Column("Code", width=4, most=4), Column("Value", "Hz", width=6, right=True), Column())


@pytest.mark.parametrize(
    ("cells", "text"),
    [
        (("RFR", "49.9", "current"), "RFR     49.9  current"),
        (("OVERLONG", "49.9", ""), "OVER    49.9"),
        (("", "1234567", "x"), "      1234567  x"),
        (("a\x1bb", "1", "two\nlines"), "a␛b        1  two␊lines"),
    ],
    ids=["fits", "cut", "number is never cut", "control characters"],
)
def test_row_keeps_its_columns(cells: tuple[str, ...], text: str) -> None:
    assert row_text(COLUMNS, cells) == text


def test_empty_cell_without_a_width_uses_no_space() -> None:
    assert row_text((Column(), Column(), Column()), ("a", "", "c")) == "a  c"


def test_title_has_the_unit() -> None:
    assert [column.title for column in COLUMNS] == ["Code", "Value [Hz]", ""]


def test_row_with_a_title_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    say_row(titled(6), ("State", "ready"))
    assert capsys.readouterr().out == "State   ready\n"


@pytest.mark.parametrize("cells", [("a",), ("a", "b", "c")])
def test_row_without_a_cell_for_each_column_is_an_error(cells: tuple[str, ...]) -> None:
    columns = (Column(), Column())
    with pytest.raises(ValueError, match="zip"):
        row_text(columns, cells)
    with pytest.raises(ValueError, match="zip"):
        table_of(columns, [("a", "b"), cells])
    with pytest.raises(ValueError, match="zip"):
        table_of(columns[1:], [("a", "b")], width=20)


OPTIONAL = (
    Column("Code"),
    Column("Name", readable=8),
    Column("First", omitted=1),
    Column("Second", omitted=2),
)


@pytest.mark.parametrize(
    ("width", "shown"),
    [
        (33, ["Code", "Name", "First", "Second"]),
        (29, ["Code", "Name", "First", "Second"]),
        (28, ["Code", "Name", "Second"]),
        (21, ["Code", "Name"]),
        (14, ["Code", "Name"]),
    ],
)
def test_narrow_table_omits_columns_in_their_order(width: int, shown: list[str]) -> None:
    out = io.StringIO()
    table = table_of(OPTIONAL, [("RFR", "Output speed", "1", "2")], width=width)
    Console(file=out, width=width).print(table)
    assert out.getvalue().splitlines()[0].split() == shown
    assert "Output" in out.getvalue()


def test_tables_are_made_in_one_place_and_csv_text_in_none() -> None:
    makers: dict[str, set[str]] = {"Table": set(), "writer": set()}
    for path in modules(PACKAGE / "cli"):
        for node in nodes_of(path):
            match node:
                case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)) if name in makers:
                    makers[name].add(path.stem)
    assert makers == {"Table": {"rows"}, "writer": set()}, "csv_text of tui.drive.plain makes CSV"
