"""Key N: why a drive does not answer, on Line and on Monitor; a stop works there."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from textual.pilot import Pilot

from tests.bus.peer import PtyPeer, silent
from tui.app import DrivePanelApp
from tui.bus.link import SerialLink
from tui.drive.profile import library
from tui.screens.keys.finding import find
from tui.screens.why import WhyScreen, reason_lines
from tui.session.connect.open_line import open_line
from tui.session.diagnosis.diagnosis import Diagnosis, diagnosed
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.reply_evidence import ReplyEvidence
from tui.session.events import EventLog

from . import fakes
from .test_flows import shown, until
from .test_frame import panel

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here"),
]


@pytest.fixture
def nobody() -> Iterator[PtyPeer]:
    """A line without an answering drive."""
    with PtyPeer(silent) as peer:
        yield peer


@asynccontextmanager
async def on_line(path: str) -> AsyncIterator[tuple[DrivePanelApp, Pilot[None]]]:
    app = DrivePanelApp(start=path, open_line=open_line)
    async with app.run_test(size=(80, 24)) as pilot:
        yield app, pilot


async def reported(app: DrivePanelApp, pilot: Pilot[None], words: str) -> str:
    """Start the diagnosis, and wait for its result."""
    await pilot.press("N")
    await until(pilot, lambda: isinstance(app.screen, WhyScreen))
    # on a busy computer a simulated drive may miss a request
    missed = "requests got no reply"
    await until(pilot, lambda: any(part in shown(app, "reasons") for part in (words, missed)))
    return shown(app, "reasons")


async def test_why_on_line_uses_address_and_profile_of_the_form(
    nobody: PtyPeer,
) -> None:
    async with on_line(nobody.path) as (app, pilot):
        await until(pilot, lambda: app.opened is not None)
        await pilot.press("escape")
        app.connection.form._fields["profile"].value = "atv71"
        app.connection.form._fields["addresses"].value = "7-9"
        text = await reported(app, pilot, "No device answers at address 7")
        assert "Address: ADD. At OFF (0)" in text
        assert "Address 7 on" in shown(app, "asked")
        assert {request[1] for request in nobody.requests} <= {3, 43}
        # it is kept among the messages, and requested again by the same key
        assert "No device answers at address 7" in app.events.events[-1].text
        await pilot.press("N")
        await until(pilot, lambda: len(app.events.events) > 1)
        await pilot.press("escape")
        await until(pilot, lambda: app.screen is app.connection)


async def test_why_explains_a_line_that_could_not_be_opened(tmp_path: Path) -> None:
    path = str(tmp_path / "ttyUSB4")
    async with on_line(f"serial:{path}") as (app, pilot):
        await until(pilot, lambda: app.connection.refused is not None)
        text = await reported(app, pilot, "There is no port")
        assert path in "".join(text.split())
        assert "dmesg" in text


async def test_why_does_not_open_a_closed_line(nobody: PtyPeer) -> None:
    app = DrivePanelApp(open_line=open_line)
    async with app.run_test(size=(80, 24)) as pilot:
        app.connection.lines.offer(nobody.path)
        app.connection.lines.focus()
        await pilot.pause()
        await reported(app, pilot, "Nothing is wrong with this line as far as it is seen")
        assert app.opened is None
        assert nobody.requests == []


async def test_why_on_monitor_is_about_the_open_drive() -> None:
    async with panel() as made:
        await reported(made.app, made.pilot, "Address 1 answers")
        await made.pilot.press("space")
        await made.until(lambda: "STOPPING" in made.shown("strip"))


def silence(family: str) -> Diagnosis:
    heard = ReplyEvidence(requested=2)
    return diagnosed(
        DiagnosticEvidence(SerialLink("/dev/ttyUSB0"), 2, library.load(family), heard=heard)
    )


@pytest.mark.parametrize("width", [40, 70])
@pytest.mark.parametrize("family", [listing.id for listing in library.listings()])
def test_every_line_fits(family: str, width: int) -> None:
    lines = list(reason_lines(silence(family), width))
    assert max(line.cell_len for line in lines) <= width
    joined = " ".join(" ".join(line.plain.split()) for line in lines)
    assert all(step.rstrip(".").split()[-1] in joined for step in silence(family).steps)


def test_why_is_found_in_the_palette() -> None:
    for query in ("why", "no answer", "diagnose"):
        assert "why" in [action.action.id for action in find(query, "line")][:2], query


@pytest.mark.parametrize("size", [(80, 24), (60, 20)], ids=["80x24", "60x20"])
def test_picture(snap_compare: Callable[..., bool], size: tuple[int, int]) -> None:
    app = fakes.app_of()

    async def found() -> Diagnosis:
        return silence("atv71")

    async def requested(pilot: Pilot[None]) -> None:
        await pilot.pause()
        app.push_screen(WhyScreen("Why no answer? Address 2 on /dev/ttyUSB0 19200 8E1", found))
        await until(pilot, lambda: "No device answers" in shown(app, "reasons"))
        app.events = EventLog()
        assert isinstance(app.screen, WhyScreen)
        app.screen.draw_frame(app.frame_now())
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=requested)


@pytest.mark.internal_errors
async def test_unexpected_error_closes_the_dialog_and_is_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def look() -> Diagnosis:
        raise RuntimeError("a defect")

    async with panel() as made:
        made.app.push_screen(WhyScreen("drive 1", look))
        await made.until(lambda: not isinstance(made.app.screen, WhyScreen) and caplog.messages)
        assert made.app.events.newest is not None
        assert made.app.events.newest.text == "Internal error: a defect"
    assert "looking for why failed" in caplog.messages
