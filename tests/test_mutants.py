"""Planting defects: one at a time, in a copy, and never taken for noticed by mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.defects.defect import Defect
from tests.mutants import DEFECTS, ROOT, STALE, SURVIVED, Stale, judge, place_of, planted

WHOLE = "def half(x):\n    return x / 2\n"


def defect(old: str, new: str = "", room: str = "room") -> Defect:
    return Defect("small", room, old, new, "Nobody.", ())


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy with one room of two files."""
    (tmp_path / "room" / "deep").mkdir(parents=True)
    (tmp_path / "room" / "one.py").write_text(WHOLE)
    (tmp_path / "room" / "deep" / "two.py").write_text("x = 1\n")
    return tmp_path


def test_a_defect_is_found_wherever_it_stands_in_its_room(copy: Path) -> None:
    assert place_of(defect("x = 1"), copy).name == "two.py"
    assert place_of(defect("x / 2", room="room/one.py"), copy).name == "one.py"


@pytest.mark.parametrize("old", ["x * 2", "x", "return"])
def test_a_text_that_does_not_stand_once_is_stale(copy: Path, old: str) -> None:
    (copy / "room" / "deep" / "two.py").write_text("return\n")
    with pytest.raises(Stale):
        place_of(defect(old), copy)


def test_a_room_that_has_gone_is_stale(copy: Path) -> None:
    with pytest.raises(Stale):
        place_of(defect("x / 2", room="gone"), copy)


def test_the_copy_is_whole_again_whatever_happens(copy: Path) -> None:
    path = copy / "room" / "one.py"
    with planted(defect("x / 2", "x * 2"), copy):
        assert "x * 2" in path.read_text()
    assert path.read_text() == WHOLE
    with pytest.raises(ZeroDivisionError), planted(defect("x / 2", "x / 0"), copy):
        raise ZeroDivisionError
    assert path.read_text() == WHOLE


@pytest.mark.parametrize(
    ("status", "output", "by"),
    [
        (0, "3 passed", SURVIVED),
        (1, "FAILED tests/a.py::test_b[x - y] - assert 1 == 2\n1 failed", "tests/a.py::test_b"),
        (1, "ERROR tests/a.py::test_b - OSError\n1 error", "tests/a.py::test_b"),
        (1, "ERROR tests/a.py - SyntaxError\n1 error", STALE),
        (2, "ERROR tests/a.py - SyntaxError\n1 error", STALE),
        (4, "ERROR: not found: tests/a.py::test_gone", STALE),
        (5, "no tests ran in 0.01s", STALE),
        (1, "INTERNALERROR> KeyError", STALE),
        (-1, "", "a hang"),
    ],
)
def test_only_a_test_that_ran_and_failed_has_noticed(status: int, output: str, by: str) -> None:
    assert judge(status, output).startswith(by)


def test_the_text_of_every_defect_stands_in_its_room() -> None:
    for defect in DEFECTS:
        assert place_of(defect, ROOT).is_file(), defect.name


def test_every_defect_has_a_name_a_sentence_and_tests_that_are_there() -> None:
    assert len({defect.name for defect in DEFECTS}) == len(DEFECTS) >= 44
    for defect in DEFECTS:
        assert defect.suffers.endswith("."), defect.name
        assert defect.old != defect.new, defect.name
        assert defect.tests, defect.name
        for test in defect.tests:
            file, _, function = test.partition("::")
            assert f"def {function}" in (ROOT / file).read_text("utf-8"), test
