"""Unusual TOML: refused with its line, and immediately."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import Mock

import pytest
import tomli

from tui.drive.profile import library
from tui.drive.toml_text import DEEPEST, toml_tables


def lists(depth: int) -> str:
    return "a = " + "[1, " * depth + "]" * depth


def tables(depth: int) -> str:
    return "a = " + '{ b = "x", c = ' * depth + "1" + " }" * depth


DEEP = {
    "lists": lists(DEEPEST + 1),
    "tables": tables(DEEPEST + 1),
    "many lists": lists(20_000),
    "many tables": tables(20_000),
    "lists alone": "a = " + "[" * 500_000,
    "lists with lines": "a = " + "[\n" * 300_000,
    "lists with comments": "a = " + "[ # \n" * 200_000,
    "keys": "a." * 500_000 + "b = 1",
    "quoted keys": '"a".' * 300_000 + "b = 1",
    "a head": "[" + "a." * 500_000 + "b]",
    "a quoted head": "[" + '"a".' * 300_000 + "b]",
    "spaced keys": "a . " * 200_000 + "b = 1",
}


@pytest.mark.timeout(30)
@pytest.mark.parametrize("name", DEEP)
def test_too_deeply_nested_file_is_refused(name: str) -> None:
    with pytest.raises(tomli.TOMLDecodeError, match=r"too deep \(at line \d+, column \d+\)"):
        toml_tables(DEEP[name])


def test_profiles_are_not_nested_too_deep() -> None:
    for text in (lists(DEEPEST - 2), tables(DEEPEST // 2), "[a.b.c.d]\ne.f = [[1], [{ g = 1 }]]"):
        assert toml_tables(text) == tomli.loads(text)
    for path in library.packaged_folder().rglob("*.toml"):
        toml_tables(path.read_text("utf-8"))


@pytest.mark.parametrize("value", ["9" * 5000, "1979-99-99", "0x" + "f" * 9_000, "99:99:99"])
def test_impossible_toml_value_is_reported(value: str) -> None:
    try:
        toml_tables(f"a = {value}")
    except tomli.TOMLDecodeError as error:
        assert "line 1" in str(error)  # noqa: PT017 - what may be read is read
    else:
        assert value.startswith("0x")


@pytest.mark.parametrize("odd", ['["ACC"]', "{ a = 1 }", "[]", "1979-05-27"])
@pytest.mark.parametrize("key", ["code", "id", "raw"])
def test_row_with_an_invalid_name_is_reported(key: str, odd: str, tmp_path: Path) -> None:
    """The error hid every other profile behind a traceback."""
    text = (library.packaged_folder() / "varmeca.toml").read_text("utf-8")
    table = {"code": "parameters", "id": "sources", "raw": "faults.codes"}[key]
    path = tmp_path / "varmeca.toml"
    path.write_text(f"{text}\n[[{table}]]\n{key} = {odd}\n", "utf-8")
    faults = library.all_faults_of(path)
    assert faults
    assert all(str(path) in fault for fault in faults)


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (RecursionError(), "Tables or lists are nested too deep (at line 1, column 1)"),
        (
            ValueError("year 0 is out of range; more"),
            "year 0 is out of range (at line 1, column 1)",
        ),
    ],
)
def test_error_of_the_parser_has_a_place(
    error: Exception, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.drive.toml_text.tomli.loads", Mock(side_effect=error))
    with pytest.raises(tomli.TOMLDecodeError) as refused:
        toml_tables("a = 1\n")
    assert str(refused.value) == text
