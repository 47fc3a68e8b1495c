"""The page of a family in the panel: reached from everywhere, scrolled, of the drive meant."""

from __future__ import annotations

from dataclasses import replace

import pytest
from textual.widgets import OptionList

from tui.bus.link import RtuTcpLink
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.keys.finding import find
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.wiring.screen import WiringScreen
from tui.session.diagnosis import examining
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.measure import Measure
from tui.session.diagnosis.reply_evidence import ReplyEvidence

from .test_frame import Panel, panel

pytestmark = pytest.mark.long


async def wiring(made: Panel) -> WiringScreen:
    await made.pilot.press("I")
    await made.until(lambda: isinstance(made.app.screen, WiringScreen))
    await made.until(lambda: "Warnings" in made.shown("page"))
    screen = made.app.screen
    assert isinstance(screen, WiringScreen)
    return screen


async def test_page_of_the_open_drive_has_its_model() -> None:
    async with panel() as made:
        await wiring(made)
        assert "Schneider Electric Altivar 71" in made.shown("title")
        assert "gateway" in made.shown("page")
        await made.until(lambda: "kW" in made.shown("title"))
        await made.pilot.press("escape")
        await made.until(lambda: isinstance(made.app.screen, MonitorScreen))


async def test_diagnosis_is_the_first_section_until_the_drive_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    measure = Measure(requested=40, answered=30, lost=10, seconds=2.0)
    heard = ReplyEvidence(requested=40, answered=30)
    seen = [DiagnosticEvidence(RtuTcpLink("h", 1), 1, heard=heard, measure=measure)]
    seen.append(replace(seen[0], measure=Measure(requested=40, answered=40)))

    async def examined(*_: object, **__: object) -> DiagnosticEvidence:
        return seen.pop(0)

    monkeypatch.setattr(examining, "examine_line", examined)
    async with panel() as made:
        await wiring(made)
        assert made.shown("page").splitlines()[0] == " Warnings"
        await made.pilot.press("N")
        await made.until(lambda: "10 of 40 requests got no reply" in made.shown("reasons"))
        await made.pilot.press("escape")
        await made.until(lambda: made.shown("page").startswith(" Trouble, measured at"))
        assert "10 of 40 requests got no reply" in made.shown("page")
        assert "Check the wires" in made.shown("page")
        await made.pilot.press("N")
        await made.until(lambda: "answers: 70 of 80" in made.shown("reasons"))
        await made.pilot.press("escape")
        await made.until(lambda: made.shown("page").startswith(" Warnings"))


@pytest.mark.sweep
async def test_scrolling_by_sections_and_lines_stops_at_the_end() -> None:
    async with panel() as made:
        screen = await wiring(made)
        first = made.shown("page").splitlines()[0]
        assert first == " Warnings"
        await made.pilot.press("tab")
        assert made.shown("page").splitlines()[0] == " Before you open the drive"
        await made.pilot.press("shift+tab")
        assert made.shown("page").splitlines()[0] == first
        await made.pilot.press("down")
        assert made.shown("page").splitlines()[0] != first
        for _ in range(40):
            await made.pilot.press("pagedown")
        last = made.shown("page")
        await made.pilot.press("down")
        assert made.shown("page") == last
        assert len(last.splitlines()) == screen.query_one("#page").size.height
        for _ in range(40):
            await made.pilot.press("pageup")
        assert made.shown("page").splitlines()[0] == first


async def test_next_drive_has_its_own_page() -> None:
    async with panel() as made:
        await made.until(lambda: made.app.fleet is not None)
        await made.pilot.press("1")
        await made.until(lambda: isinstance(made.app.screen, ConnectionScreen))
        await made.pilot.press("s")
        await made.until(lambda: len(made.app.fleet.consoles if made.app.fleet else []) == 2)
        await made.pilot.press("2")
        await made.until(lambda: isinstance(made.app.screen, MonitorScreen))
        await wiring(made)
        await made.pilot.press("right_square_bracket")
        await made.until(lambda: "Altivar 312" in made.shown("title"))
        # messages belong to no drive: the next drive is shown on Monitor
        await made.pilot.press("m")
        await made.pilot.press("left_square_bracket")
        await made.until(lambda: isinstance(made.app.screen, MonitorScreen))


async def test_page_on_line_is_that_of_the_selected_drive() -> None:
    async with panel() as made:
        await made.pilot.press("1", "s")
        await made.until(lambda: len(made.app.fleet.consoles if made.app.fleet else []) == 2)
        screen = made.app.screen
        assert isinstance(screen, ConnectionScreen)
        drives = screen.query_one("#drives", OptionList)
        drives.focus()
        await made.until(lambda: drives.option_count == 2)
        drives.highlighted = 1
        await made.until(lambda: screen.pointed is not None and screen.pointed.device == 2)
        await wiring(made)
        assert "Altivar 312" in made.shown("title")
        await made.pilot.press("escape")
        await made.until(lambda: made.app.screen is screen)


async def test_stop_works_on_wiring_and_nothing_is_written() -> None:
    async with panel() as made:
        await wiring(made)
        await made.pilot.press("space")
        await made.until(lambda: "STOPPING" in made.shown("strip"))


def test_wiring_is_found_in_the_palette() -> None:
    for query in ("wiring", "pins", "errata", "warnings"):
        assert find(query, "monitor")[0].action.id == "wiring", query
