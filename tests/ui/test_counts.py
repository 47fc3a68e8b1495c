"""Counts in texts of the screens: zero has a sentence of its own, or is not named."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tui.screens.frames.frame_list import count_text
from tui.screens.parameters.set_keys import difference_text, staged_text

PICTURES = Path(__file__).with_name("__snapshots__")
TEXT = re.compile(r"<text[^>]*>([^<]*)</text>")
ZERO = re.compile(
    r"(?<![\d.,:/-])0 (?:more |of \d+ )?(?:addresses|can|differ|drives|edits|equal|exchanges|"
    r"faults|files|found|frames|matches|messages|not|parameters|requests|settings|skipped|slots|staged|"
    r"still|written)\b|\b(?:Changed|Differs|Favorites|Staged|Unsaved) 0\b"
)


def pictured() -> Iterator[tuple[str, str]]:
    """The name and the texts of every picture of the screens."""
    for path in sorted(PICTURES.rglob("*.svg")):
        parts = TEXT.findall(path.read_text("utf-8"))
        yield path.name, html.unescape(" ".join(parts)).replace("\xa0", " ")


def test_no_picture_names_a_count_of_zero() -> None:
    found = {name: hits for name, text in pictured() if (hits := ZERO.findall(text))}
    assert found == {}
    named = " 0 staged ", "0 of 12 settings", "Staged 0 "
    assert all(ZERO.search(text) for text in named)
    assert not any(ZERO.search(text) for text in ("10 staged", "1.0 found", "Staged 10"))


@pytest.mark.parametrize(
    ("counts", "text"),
    [
        ((3, 20, 1), "a.toml: 3 can be staged, 20 equal, 1 skipped."),
        ((3, 0, 0), "a.toml: 3 can be staged."),
        ((0, 20, 0), "a.toml: nothing can be staged, 20 equal."),
        ((0, 0, 0), "a.toml: nothing can be staged."),
    ],
)
def test_comparison_names_no_count_of_zero(counts: tuple[int, int, int], text: str) -> None:
    assert difference_text("a.toml", *counts) == text


def test_nothing_staged_is_reported_without_a_count() -> None:
    assert staged_text(0, "device 5") == "Nothing staged from device 5."
    assert staged_text(2, "device 5") == "Staged 2 from device 5."


@pytest.mark.parametrize(
    ("matches", "kept", "filtered", "text"),
    [
        (0, 0, False, "no frame yet"),
        (0, 0, True, "no frame yet"),
        (1, 1, False, "1 frame"),
        (12, 12, False, "12 frames"),
        (0, 12, True, "none of 12 frames"),
        (3, 12, True, "3 of 12 frames"),
    ],
)
def test_count_of_frames_names_no_zero(matches: int, kept: int, filtered: bool, text: str) -> None:
    assert count_text(matches, kept, filtered=filtered) == text
