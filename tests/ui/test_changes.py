"""Messages: what changed since a typed time, from the journal and the record."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from textual.pilot import Pilot

from tests.session import test_changes as records
from tests.session.test_journal import entry
from tui.screens.messages.screen import MessagesScreen
from tui.session.clock import Clock
from tui.widgets.lines import Lines

from . import fakes
from .test_flows import until

SIZES = pytest.mark.parametrize(
    "size",
    [
        pytest.param((80, 24), id="80x24"),
        pytest.param((120, 40), id="120x40", marks=pytest.mark.sweep),
    ],
)


class MorningClock(Clock):
    """07:30 UTC of the day after the record."""

    def wall(self) -> float:
        return records.START + 9.5 * 3600


@pytest.fixture
def history(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The record of a night: two runs, a lost line, a write and a trip."""
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")
    folder = Path(os.environ["DRIVEPANEL_STATE"]) / "record"
    rows = [records.status(second, records.READY) for second in (0, 9, 7000)]
    rows += [records.status(second, records.FORWARD) for second in range(1, 9)]
    rows += [records.status(second, records.REVERSE, 2) for second in range(7001, 7009)]
    rows += [records.row(second + 0.5, records.REFERENCE, 400) for second in range(1, 8)]
    rows.append(records.row(0.5, records.COMMAND, 0xF, function=6, who=records.PROGRAM))
    events = [
        records.event(7100, "line", "lost Broken pipe"),
        records.event(7190, "line", "connected"),
    ]
    records.write(folder, rows, events)
    at = datetime.fromtimestamp(records.START + 7300, UTC).isoformat()
    write = replace(entry(1), time=at, line=records.LINE, old="3.0 s", new="4.0 s")
    trip = replace(write, kind="fault", code="ObF", new="Overbraking", answer="tripped")
    text = "".join(json.dumps(asdict(item)) + "\n" for item in (write, trip))
    (folder.parent / "journal.jsonl").write_text(text)
    return folder


def shown(screen: MessagesScreen, place: str) -> list[str]:
    return [line.plain for line in screen.query_one(f"#{place}", Lines).lines]


async def opened(pilot: Pilot[None]) -> MessagesScreen:
    """Messages with the changes since the proposed time."""
    screen = MessagesScreen()
    await pilot.app.push_screen(screen)
    await pilot.press("J")
    await until(pilot, lambda: pilot.app.screen is not screen)
    await pilot.press("enter")
    await until(pilot, lambda: "changes" in " ".join(shown(screen, "title")))
    return screen


@SIZES
def test_changes_since_a_time(
    snap_compare: Callable[..., bool], size: tuple[int, int], history: Path
) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    app.panel_clock = MorningClock()

    async def show(pilot: Pilot[None]) -> None:
        await opened(pilot)

    assert snap_compare(app, terminal_size=size, run_before=show)


async def test_esc_returns_to_the_messages_and_then_leaves(history: Path) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    app.panel_clock = MorningClock()
    app.events.add("told", "Ignored 3 keys that arrived together.")
    async with app.run_test() as pilot:
        screen = await opened(pilot)
        assert any("RUN reverse" in line for line in shown(screen, "list"))
        await pilot.press("escape")
        await until(pilot, lambda: "Ignored 3 keys" in " ".join(shown(screen, "list")))
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is not screen)


async def test_text_that_is_not_a_time_stays_in_the_field(history: Path) -> None:
    app = fakes.app_of(kind=fakes.Easel)
    app.panel_clock = MorningClock()
    async with app.run_test() as pilot:
        screen = MessagesScreen()
        await app.push_screen(screen)
        await pilot.press("J", "x", "enter")
        await until(pilot, lambda: "is not a time" in str(app.screen.query_one("#fault").render()))
        await pilot.press(*["backspace"] * 6, *"1m", "enter")
        await until(pilot, lambda: app.screen is screen)
        await until(pilot, lambda: "Nothing since then" in " ".join(shown(screen, "list")))


async def test_journal_that_cannot_be_read_is_reported(history: Path) -> None:
    (history.parent / "journal.jsonl").unlink()
    (history.parent / "journal.jsonl").mkdir()
    app = fakes.app_of(kind=fakes.Easel)
    async with app.run_test() as pilot:
        screen = MessagesScreen()
        await app.push_screen(screen)
        await pilot.press("J", "enter")
        await until(pilot, lambda: "cannot be read" in " ".join(shown(screen, "list")))
