"""Start-up on the panel: it records, leads to where things are done, and moves no motor."""

from __future__ import annotations

import time
from datetime import datetime
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import pytest
from rich.style import Style
from textual.screen import ModalScreen

from tui.bus.fake import FakeLine
from tui.drive.profile import library
from tui.screens.dialogs.ask import Ask
from tui.screens.parameters.edit_value import EditNumber, PickValue
from tui.screens.startup.run_rows import RunRows
from tui.screens.startup.screen import StartUpScreen
from tui.screens.startup.view import StartUpView, walk_lines
from tui.session.clock import REAL_CLOCK
from tui.session.drive import DriveSession
from tui.session.journal import Entry, Journal
from tui.session.monitor.trend import TrendPoint
from tui.session.startup.judging import StepRow
from tui.session.startup.start_up import StartUp, open_start_up

from .test_command_flows import Bench, bench, writes
from .test_flows import shown, until


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path))
    monkeypatch.chdir(tmp_path)  # of backups and reports


async def start_up(made: Bench, step: str = "") -> StartUp:
    """Open Start-up, at a step if one is named, with its values read."""
    app = made.app
    while isinstance(app.screen, ModalScreen):
        await made.pilot.press("escape")
    while app.place != "start-up":
        await made.pilot.press("B")  # one that closes a run line is swallowed
        await made.pilot.pause(0.1)
    await until(made.pilot, lambda: app.chosen is not None and app.chosen.start_up is not None)
    assert app.chosen is not None
    opened = app.chosen.start_up
    assert opened is not None
    if step:
        opened.go([s.step for s in opened.guide.steps].index(step) - opened.index)
        opened.row = 0
        assert isinstance(app.screen, StartUpScreen)
        app.screen.read_again()
        screen = app.screen
        await until(made.pilot, lambda: set(opened.step.codes) <= set(screen.readings))
        screen.look()
    return opened


def has_turned(made: Bench) -> bool:
    """True if the trend shows a motor that turns."""
    point = made.app.chosen.monitor.last_point if made.app.chosen is not None else None
    return point is not None and (point.values[0] or 0.0) > 1.0


async def row(made: Bench, opened: StartUp, kind: str) -> None:
    """Put the cursor on the first row of a kind."""
    opened.row = [str(found.kind) for found in opened.rows].index(kind)


async def test_number_of_the_nameplate_is_proposed_and_only_staged() -> None:
    async with bench("atv71") as made:
        opened = await start_up(made, "Nameplate")
        assert "drive" not in shown(made.app, "steps").split("UNS on")[1].split("\n")[0]
        power = shown(made.app, "steps").split("NPR?")[1].split("\n")[0]
        assert " raw " in power  # no document has its scale
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
        await made.pilot.pause(0.4)
        await made.pilot.press(*"4k", "enter")
        await until(made.pilot, lambda: "4k" in str(made.app.screen.query_one("#fault").render()))
        await made.pilot.press("backspace", *"00", "enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await until(
            made.pilot, lambda: "→ 400 V" in str(made.app.screen.query_one("#held").render())
        )
        await made.pilot.pause(0.4)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: "1 staged" in shown(made.app, "said"))
        opened = await start_up(made, "Nameplate")
        await until(made.pilot, lambda: "400  drive 230 V  differs" in shown(made.app, "steps"))
        assert opened.record.entries == {"UNS": "400"}
        await row(made, opened, "done")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: "Not done" in shown(made.app, "said"))
        assert writes(made.app) == []


def recorded(journal: Journal, row: StepRow, points: list[TrendPoint]) -> tuple[str, str]:
    """Press Enter on a row; return the entry, and the message otherwise."""
    entries: list[str] = []
    texts: list[str] = []
    session = DriveSession(FakeLine(), 1, library.load("atv71"))
    rows: Any = SimpleNamespace(
        app=SimpleNamespace(clock=REAL_CLOCK, tell=texts.append, action_goto=lambda _: None),
        console=SimpleNamespace(journal=journal, monitor=SimpleNamespace(trend=points)),
        session=session, _enter=lambda row, key, text: entries.append(text),
        _clock_text=lambda moment: "12:00:00", _has_no_frequency=False,
        _go_and_run=lambda *_: None,
    )  # fmt: skip
    rows._other_method = partial(RunRows._other_method, rows)
    record = SimpleNamespace(entries={})
    step = SimpleNamespace(hz=[], rated="")
    start_up: Any = SimpleNamespace(
        since=time.monotonic() - 60, chosen=row, record=record, step=step
    )
    if row.kind == "test":
        RunRows._record_test(rows, start_up)
    else:
        RunRows._record_run(rows, start_up, row)
    return " ".join(entries), " ".join(texts)


def entry_of(why: str, kind: Literal["write", "proof"], ago: float = 1.0) -> Entry:
    """An entry of the journal about drive 1."""
    text = datetime.fromtimestamp(time.time() - ago).astimezone().isoformat()
    line = DriveSession(FakeLine(), 1, library.load("atv71")).line_text
    return Entry(
        text, line, 1, "atv71", "CMD", 8501, None, "", 7, "tested", "as set", None, why, kind=kind
    )


def test_newest_communication_loss_test_is_recorded(tmp_path: Path) -> None:
    journal, row = Journal(tmp_path), StepRow("test", "Test")
    assert "press P" in recorded(journal, row, [])[1]
    journal.add(entry_of("test of the communication timeout", "proof"))
    assert "as set: tested" in recorded(journal, row, [])[0]
    journal.close()


@pytest.mark.parametrize(
    ("sent", "ago", "kept"),
    [("Quick stop", 3.0, True), ("Ramp stop", 3.0, False), ("Ramp stop", 30.0, True)],
)
def test_stop_is_recorded_as_the_method_that_was_sent(
    sent: str, ago: float, kept: bool, tmp_path: Path
) -> None:
    journal, now = Journal(tmp_path), time.monotonic()
    journal.add(entry_of(f"stopped: {sent}", "write", ago))
    points = [TrendPoint(now - 5 + t, (max(0.0, 20.0 - 10 * max(0, t - 2)), 1.0)) for t in range(5)]
    entries, texts = recorded(journal, StepRow("stop", "quick-stop"), points)
    assert bool(entries) is kept
    assert ("another one: Ramp stop" in texts) is not kept
    journal.close()


@pytest.mark.sweep
async def test_wrong_direction_proposes_its_parameter_and_stays_open() -> None:
    async with bench("atv71") as made:
        opened = await start_up(made, "Direction")
        await row(made, opened, "turned")
        await made.pilot.press("enter")  # before any run
        await until(made.pilot, lambda: "no run was seen" in shown(made.app, "said"))
        await row(made, opened, "run")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: made.app.place == "monitor")
        await until(made.pilot, lambda: "press a to arm, r, type 5" in shown(made.app, "said"))
        assert writes(made.app) == []
        await made.running()
        await until(made.pilot, lambda: has_turned(made))
        opened = await start_up(made, "Direction")
        await row(made, opened, "run")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: "Run" in opened.record.entries)
        opened.row = [found.key for found in opened.rows].index("the other way")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickValue))
        await made.pilot.press("space")
        await until(made.pilot, lambda: made.speed() == 0)
        assert not isinstance(made.app.screen, PickValue)  # a stop cancels the proposal
        assert made.drive().raw("PHR") == 0
        opened = await start_up(made, "Direction")
        assert opened.record.state == "deficient"
        await row(made, opened, "run")
        await made.pilot.press("enter")  # the run before the deficiency does not count
        await until(made.pilot, lambda: made.app.place == "monitor")


@pytest.mark.sweep
async def test_stop_ends_a_typed_answer_of_the_start_up() -> None:
    async with bench("atv71") as made:
        await made.running()
        opened = await start_up(made, "Insulation")
        await row(made, opened, "skip")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
        await made.pilot.press("n", "o", "f12")
        await until(made.pilot, lambda: made.speed() == 0)
        assert made.app.place == "start-up"
        assert not isinstance(made.app.screen, Ask)
        assert opened.record.state == "open"


@pytest.mark.sweep
async def test_changed_settings_are_named_after_a_lost_line() -> None:
    async with bench("atv71") as made:
        opened = await start_up(made, "Ramps")
        await until(made.pilot, lambda: not opened.changes.needs_all)
        opened.changes.lost()
        made.drive().set("ACC", 55)
        await until(made.pilot, lambda: "ACC 3.0 s → 5.5 s" in shown(made.app, "steps"))
        assert opened.step.step == "Ramps"


@pytest.mark.sweep
@pytest.mark.parametrize("family", ["atv21", "atv312", "atv71", "powerdrive"])
async def test_no_row_of_any_step_writes_or_moves_a_motor(family: str) -> None:
    """Armed; each row gets Enter three times, then the keys that would run the motor on Monitor."""
    async with bench(family) as made:
        await made.armed()
        opened = await start_up(made)
        for step in opened.guide.steps:
            for number in range(len(opened.rows) + 3):
                if not made.is_armed():
                    await made.pilot.press("2")
                    await made.armed()
                opened = await start_up(made, step.step)
                if number >= len(opened.rows):
                    break
                opened.row = number
                await made.pilot.press("enter")
                await made.pilot.pause(0.05)
                await made.pilot.press("enter")
                await made.pilot.press("enter")
                if made.app.place != "monitor":  # there they are the way to run it
                    await made.pilot.press("r", "enter")
                assert writes(made.app) == [], (step.step, number)
                assert made.speed() == 0


@pytest.mark.parametrize("size", [(60, 16), (80, 24), (120, 40)])
def test_step_is_whole_on_every_screen(size: tuple[int, int]) -> None:
    """At 80 x 24 the sources ended at the lower edge, at 60 x 16 the tasks did."""
    for family in ("atv71", "powerdrive"):
        profile = library.load(family)
        opened = open_start_up(DriveSession(FakeLine(), 1, profile), f"{family}-{size}", None)
        for _ in opened.guide.steps:
            step = opened.step
            view = StartUpView(opened, profile, {}, {}, {}, 0.0, "", lambda *_: False, "")
            lines = [line.plain for line in walk_lines(view, size[0], size[1] - 5)]
            assert len(lines) == size[1] - 5
            assert max(map(len, lines)) <= size[0]
            text = " ".join(" ".join(line.partition("│")[2] for line in lines).split())
            assert step.text in text, step.step
            if size[1] > 16:
                assert step.note in text, step.step
                assert "Source: " in text, step.step
                assert f"({step.confidence})" in text, step.step
            opened.go(1)


def test_only_what_stands_out_is_bold() -> None:
    """The style of the first sign must not be that of the whole line."""
    opened = open_start_up(DriveSession(FakeLine(), 1, library.load("atv71")), "bold", None)
    while not any(row.kind == "parameter" for row in opened.rows):
        opened.go(1)
    view = StartUpView(opened, library.load("atv71"), {}, {}, {}, 0.0, "", lambda *_: False, "")
    lines = walk_lines(view, 120, 40)
    assert not any(line.style for line in lines)
    bold = [
        text
        for line in lines
        for span in line.spans
        if isinstance(span.style, Style)
        and span.style.bold
        and (text := line.plain[span.start : span.end].strip())
    ]
    assert 0 < len(bold) < 10
    assert max(map(len, bold)) < 30, bold
