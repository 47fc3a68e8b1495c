"""Parts of the frame that stay where they are in every picture: the tabs and the stop key."""

from __future__ import annotations

import html
import re
from collections import defaultdict
from pathlib import Path

import pytest

PICTURES = sorted(Path(__file__).with_name("__snapshots__").rglob("*.svg"))
CELL = 12.2
"""Width of a cell in a picture."""
TEXT = re.compile(r'<text class="[^"]*" x="([\d.]+)" [^>]*-line-(\d+)\)">([^<]*)</text>')
STOPS = re.compile(r" (Space|F12) STOP (ALL|\d)| Space cannot stop here")
REPLAY = re.compile(r"  no motor to stop| (Space|F12) STOP LIVE ALL")
"""Of a replay: it has no tabs, and stops no drive of its own."""
TAB = re.compile(r"(?<!\S)[1-9](?=\S? ?[A-Z])")
SIZE = re.compile(r"(\d+)x\d+\]?\.svg$")


def rows(path: Path) -> list[str]:
    """The rows of a pictured terminal."""
    cells: defaultdict[int, dict[int, str]] = defaultdict(dict)
    for x, row, text in TEXT.findall(path.read_text("utf-8")):
        for column, sign in enumerate(html.unescape(text), start=round(float(x) / CELL)):
            cells[int(row)][column] = sign.replace("\xa0", " ")
    return [
        "".join(cells[row].get(column, " ") for column in range(max(cells[row], default=-1) + 1))
        for row in range(max(cells) + 1)
    ]


@pytest.fixture(scope="module")
def pictured() -> dict[str, list[str]]:
    """The rows of each picture that is not too small for the panel."""
    found = {path.name: rows(path) for path in PICTURES if "too small" not in path.name}
    assert len(found) > 300
    return found


def test_stop_key_is_first_in_the_last_row_of_every_picture(
    pictured: dict[str, list[str]],
) -> None:
    wrong = {
        name
        for name, shown in pictured.items()
        if not (REPLAY if "REPLAY" in shown[0] else STOPS).match(shown[-1])
    }
    assert wrong == set()


def test_marks_and_dialogs_move_no_tab(pictured: dict[str, list[str]]) -> None:
    places = defaultdict(set)
    for name, shown in pictured.items():
        if (size := SIZE.search(name)) and "REPLAY" not in shown[0]:
            places[size[1]].add(tuple(found.start() for found in TAB.finditer(shown[1])))
    assert places.keys() >= {"60", "80", "120", "200"}
    assert {width: tabs for width, tabs in places.items() if len(tabs) != 1} == {}
    assert all(len(tabs) >= 7 for (tabs,) in places.values())
