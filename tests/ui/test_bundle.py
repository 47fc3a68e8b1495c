"""A bundle from the palette: the file, the screens in it, its progress, and its end by Esc."""

from __future__ import annotations

import asyncio
import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from tests.bus.peer import PtyPeer, silent
from tui.app import DrivePanelApp
from tui.cli.shared.diagnosis_documents import drive_documents
from tui.screens.bundle import CANCELLED, NO_LINE_CHOSEN, BundleScreen
from tui.screens.choosing import Palette
from tui.screens.dialogs.ask import Ask
from tui.session.bundle.parts import PartProgress
from tui.session.bundle.work import Bundle
from tui.session.connect.open_line import open_line
from tui.session.events import EventLog

from . import fakes
from .test_flows import demo, shown, to_monitor, until

pytestmark = pytest.mark.long


def panel(start: str, opener: Callable[..., object] = open_line) -> DrivePanelApp:
    return DrivePanelApp(open_line=opener, start=start, drive_documents=drive_documents)  # type: ignore[arg-type]


async def begin(app: DrivePanelApp, pilot: Pilot[None], file: Path) -> None:
    """Find the action in the palette, and name the file."""
    await pilot.press("ctrl+p")
    await until(pilot, lambda: isinstance(app.screen, Palette))
    await pilot.press(*"bundle", "enter")
    await until(pilot, lambda: isinstance(app.screen, Ask))
    assert app.screen.query_one(Input).value.endswith(".zip")
    app.screen.query_one(Input).value = str(file)
    await pilot.press("enter")
    await until(pilot, lambda: isinstance(app.screen, BundleScreen))


def unzipped(file: Path) -> dict[str, str]:
    with zipfile.ZipFile(file) as opened:
        names = opened.namelist()
        return {
            name.partition("/")[2]: opened.read(name).decode("utf-8", "replace") for name in names
        }


@pytest.mark.sweep
async def test_bundle_of_open_drives_has_the_screens_and_messages(tmp_path: Path) -> None:
    file = tmp_path / "new" / "a.zip"
    app = panel("demo", demo)
    async with app.run_test(size=(80, 24)) as pilot:
        await to_monitor(app, pilot, 2)
        await until(pilot, lambda: "FORWARD" in shown(app, "strip"))
        app.events.add("done", "A message to find.", 2)
        await begin(app, pilot, file)
        await until(pilot, lambda: "Saved" in shown(app, "progress"))
        assert str(file) in "".join(shown(app, "progress").split())
        assert "Saved: bundle of" in app.events.events[-1].text
        await pilot.press("escape")
        await until(pilot, lambda: not isinstance(app.screen, BundleScreen))
        assert app.fleet is not None
        devices = list(app.fleet.found)
    files = unzipped(file)
    assert "FORWARD" in files["screens/2-monitor.txt"]
    assert "screens/1-line.txt" in files
    assert "drive 2: A message to find." in files["messages.txt"]
    for device in devices:
        why = json.loads(files[f"drive-{device}/why.json"])
        assert why["answers"] is True, why
        assert f"drive-{device}/settings.toml" in files


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")
async def test_bundle_of_a_line_that_could_not_be_opened(tmp_path: Path) -> None:
    app = panel(f"serial:{tmp_path / 'ttyUSB4'}")
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: app.connection.refused is not None)
        await begin(app, pilot, tmp_path / "a.zip")
        await until(pilot, lambda: "Not collected" in shown(app, "progress"))
    files = unzipped(tmp_path / "a.zip")
    assert json.loads(files["drive-1/why.json"])["rung"] == "no-port"
    assert "screens/1-line.txt" in files


@pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")
async def test_esc_cancels_and_leaves_no_file(tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    with PtyPeer(silent) as peer:
        app = panel(peer.path)
        async with app.run_test(size=(80, 24)) as pilot:
            await until(pilot, lambda: app.opened is not None)
            await pilot.press("escape")
            await begin(app, pilot, file)
            await until(pilot, lambda: "Collecting" in shown(app, "progress"))
            await pilot.press("escape")
            await until(pilot, lambda: not isinstance(app.screen, BundleScreen))
            assert app.events.events[-1].text == CANCELLED
            assert not [worker for worker in app.workers if worker.group == "bundle"]
    assert [text for text in os.listdir(tmp_path) if "a.zip" in text] == []


async def test_bundle_without_a_line_is_refused() -> None:
    app = DrivePanelApp(open_line=open_line, drive_documents=drive_documents)
    async with app.run_test(size=(80, 24)) as pilot:
        app.connection.lines.clear_options()
        app.action_bundle()
        await pilot.pause()
        assert app.events.events[-1].text == NO_LINE_CHOSEN


FINISHED = Bundle(
    b"",
    ("README.txt", "line.json", "versions.json", "drive-2/why.json", "journal.json"),
    {
        "drive-2/counters.json": "Device 2 did not answer within 1.00 s.",
        "drive-2/settings.toml": "Device 2 did not answer within 1.00 s.",
        "drive-2/report.md": "Device 2 did not answer within 1.00 s.",
        "log.txt": "There is no log: /var/lib/drivepanel/drivepanel.log.",
    },
    {},
)


@pytest.mark.parametrize("size", [(80, 24), (120, 40)], ids=["80x24", "120x40"])
@pytest.mark.parametrize("state", ["collecting", "finished"])
def test_picture(
    snap_compare: Callable[..., bool],
    size: tuple[int, int],
    state: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = fakes.app_of()
    monkeypatch.setattr("tui.drive.settings.set_file.write_file", lambda *_, **__: None)

    async def made(progress: PartProgress) -> Bundle:
        progress(6, 17, "drive-2/settings.toml")
        if state == "collecting":
            await asyncio.sleep(3600)
        return FINISHED

    async def looked_at(pilot: Pilot[None]) -> None:
        await pilot.pause()
        app.push_screen(BundleScreen(Path("/var/lib/drivepanel-ttyUSB0-20261123-1730.zip"), made))
        words = "Collecting 7" if state == "collecting" else "Not collected"
        await until(pilot, lambda: words in shown(app, "progress"))
        app.events = EventLog()  # its message has a time
        assert isinstance(app.screen, BundleScreen)
        app.screen.draw_frame(app.frame_now())
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=looked_at)
