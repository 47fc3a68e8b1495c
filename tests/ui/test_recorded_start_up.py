"""The start-up page in every step of some families, drawn as recorded.

`recorded_start_up.txt` is like `recorded_pages.txt`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.recorded import AFTER_A_CHANGE, sections
from tui.bus.fake import FakeLine
from tui.drive.profile import library
from tui.screens.startup.view import StartUpView, title_line, walk_lines
from tui.session.drive import DriveSession
from tui.session.shown import Shown
from tui.session.startup.guide import find_guide
from tui.session.startup.progress import StepRecord, StepState
from tui.session.startup.start_up import StartUp

from . import fakes, test_parameter_pictures
from .test_recorded_pages import Pages

TEXTS = Path(__file__).with_name("recorded_start_up.txt")


def startups() -> Iterator[tuple[str, StartUp, StartUpView]]:
    """Each step of each family, done in several ways."""
    states: tuple[StepState, ...] = ("open", "done", "skipped", "deficient")
    for family in ("atv71", "atv21", "powerdrive"):
        profile = library.load(family)
        session = DriveSession(FakeLine(), 1, profile, clock=fakes.StillClock())
        start_up = StartUp(session, "recorded", find_guide(profile))
        start_up.progress.saved, start_up.progress.begun = "", "2026-11-21T08:10:00+01:00"
        raws = {**test_parameter_pictures.HELD, "ACC": 55}
        known = {code: raw for code, raw in raws.items() if profile.get(code) is not None}
        readings: dict[str, Shown] = dict(fakes.readings_of(profile, known, fakes.NOW - 0.1))
        for number, step in enumerate(start_up.guide.steps):
            start_up.go(number - start_up.index)
            for turn in (number % 4, (number + 2) % 4):
                state = states[turn]
                rows_now = start_up.rows
                entries = {
                    row.key: f"{7 * n}" for n, row in enumerate(rows_now) if n % 2 == turn % 2
                }
                start_up.progress.steps[step.step] = StepRecord(
                    state=state, text="" if state in ("open", "done") else f"Reason {number}.",
                    time="" if state == "open" else "2026-11-21T09:15:30+01:00",
                    entries=entries if turn else {}, raws={"ACC": 30, "DEC": 30} if turn else {},
                    past=["deficient 08:12: Fan noisy."] * (turn % 2),
                )  # fmt: skip
                start_up.row = (number + turn * 3) % len(rows_now)
                aged = {c: r.aged(fakes.NOW + 30, 6.0) for c, r in readings.items()}
                view = StartUpView(
                    start_up, profile, aged if turn == 3 else readings, known if turn else {},
                    {"ACC": "5.0 s"} if turn % 2 else {}, fakes.NOW + (30 if turn == 3 else 0),
                    "ATV71HU15M3" if turn < 2 else "", lambda row, entry: entry == "7",
                    "2026-11-21" if number % 5 else "2026-11-22",
                )  # fmt: skip
                yield f"{family} {number} {state}", start_up, view


def startup() -> Iterator[str]:
    pages = Pages()
    for number, (name, start_up, view) in enumerate(startups()):
        start_up.trouble = "Results are not saved: disk full." if number % 7 == 0 else ""
        start_up.notice = "The file was damaged." if number % 7 < 2 else ""
        start_up.resumed = number % 3 == 0
        start_up.changes.texts = ("ACC 3.0 s → 5.5 s", "HSP 50 Hz → 60 Hz")[: number % 5 % 3]
        width, height = ((60, 11), (80, 19), (120, 35), (71, 24), (110, 26))[number % 5]
        lines = [title_line(view, width), *walk_lines(view, width, height)]
        yield from pages.page(f"{name} {width}x{height}", lines)


SECTIONS: tuple[Callable[[], Iterator[str]], ...] = (startup,)


def test_each_step_is_drawn_as_recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path))
    assert "\n".join(startup()) == sections(TEXTS)["startup"], AFTER_A_CHANGE
