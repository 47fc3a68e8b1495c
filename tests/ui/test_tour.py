"""Every step of docs/tour.md on the demo, as printed: the keys, and the visible texts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from textual.widgets import OptionList

from tui.app import DrivePanelApp
from tui.drive.profile.library import demo_drives
from tui.session.connect.open_line import OpenLine, demo_line

from .test_flows import picture, until

pytestmark = pytest.mark.drawn

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tour.md"
STEP = re.compile(r"^\| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
SEEN = re.compile(r"`([^`]+)`")
READ = re.compile(r"→ 0[1-5] 03 [0-9A-F]{2}")
"""The bytes of a request of the demo."""
NAMES = {".": "full_stop", "/": "slash", "?": "question_mark", "Esc": "escape"}
QUOTES = 20
"""Texts of the screen that the page quotes, at least."""


def steps() -> list[tuple[list[str], list[str]]]:
    """Keys, as Textual names them, with the texts quoted next to them."""
    text = PAGE.read_text("utf-8")
    rows = [row for row in STEP.findall(text) if row[0] != "type" and "---" not in row[0]]
    return [([_key(key) for key in typed.split()], SEEN.findall(see)) for typed, see in rows]


def _key(reported: str) -> str:
    return NAMES.get(reported, reported if len(reported) == 1 else reported.lower())


def plain(text: str) -> str:
    """Without the spaces that only place it."""
    return " ".join(text.split())


def on_screen(app: DrivePanelApp) -> str:
    """All text on the screen."""
    return plain(picture(app))


def demo(*_: object, **__: object) -> OpenLine:
    return demo_line({id: hertz for id, (_, hertz) in demo_drives().items()})


def test_tour_has_its_steps() -> None:
    reported = steps()
    assert len(reported) >= 24
    assert ["ctrl+u", "3", "full_stop", "5"] in [keys for keys, _ in reported]
    assert sum(len(texts) for _, texts in reported) >= QUOTES


@pytest.mark.sweep  # what it shows is tested screen by screen
async def test_tour_keys_show_what_the_page_says(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)
    monkeypatch.chdir(tmp_path)
    app = DrivePanelApp(open_line=demo, start="demo")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.connection.drives.option_count == len(demo_drives()))
        app.connection.query_one("#drives", OptionList).focus()
        await pilot.press("down", "down", "down", "enter")
        await until(pilot, lambda: "MACHINE 4·ATV71 ▶ FORWARD" in on_screen(app))
        for keys, texts in steps():
            for key in keys:
                await pilot.press(key)
            for text in texts:
                await until(pilot, lambda text=text: plain(text) in on_screen(app))  # type: ignore[misc]
            if keys == ["space"]:
                await until(pilot, lambda: "STANDBY 0.0" in on_screen(app))
            elif keys == ["tab"]:
                # of any drive: which of them are on the screen is chance
                await until(pilot, lambda: READ.search(on_screen(app)) is not None)
            elif keys == ["up", "up"]:
                await until(pilot, lambda: "→ 32.0 Hz" in on_screen(app))
