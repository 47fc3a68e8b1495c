"""Marked parameters keep their stored form, which earlier versions read and write."""

from __future__ import annotations

import json

from tui.session.paths import state_folder
from tui.session.settings.editor import Marks, load_marks, save_marks

MARKS = Marks(favorites=("ACC", "HSP"), confirmed=("LSP",), recent=("DEC",))
STORED = {"favourites": ["ACC", "HSP"], "confirmed": ["LSP"], "recent": ["DEC"]}


def test_stored_marks_keep_their_keys() -> None:
    save_marks("atv71", MARKS)
    assert json.loads((state_folder() / "marks-atv71.json").read_text("utf-8")) == STORED


def test_marks_of_an_earlier_version_are_loaded() -> None:
    state_folder().mkdir(parents=True, exist_ok=True)
    (state_folder() / "marks-atv71.json").write_text(json.dumps(STORED), "utf-8")
    assert load_marks("atv71") == MARKS


def test_damaged_marks_are_empty() -> None:
    state_folder().mkdir(parents=True, exist_ok=True)
    (state_folder() / "marks-atv71.json").write_text('{"favourites": 1, "recent": [2]}', "utf-8")
    assert load_marks("atv71") == Marks()
