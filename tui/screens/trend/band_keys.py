"""Keys of Trend that choose a band, and save what is shown."""

from __future__ import annotations

import asyncio
import sqlite3
import time
from pathlib import Path

from tui.drive.sentences import counted
from tui.session.console import DriveConsole
from tui.session.monitor.trend_bands import TrendBand
from tui.session.paths import state_folder

from .loading import TrendBands

SAVED_BOTH = "Saved 1 value: {path} and .svg", "Saved {count} values: {path} and .svg"


class BandKeys(TrendBands):
    """Part of the screen with questions: the parameter of a band, and the name of a file."""

    def action_pick_band(self) -> None:
        """Choose the parameter of the band."""
        console: DriveConsole | None = self.console
        if self._selected < len(self.traces):
            console = self.traces[self._selected].console
        if console is None:
            self.action_pick_drive()
            return
        self._pick(console)

    def _pick(self, console: DriveConsole) -> None:
        from ..dialogs.pick_parameter import PickParameter

        place = self._selected

        def picked(code: str | None) -> None:
            if code is None:
                return
            bands = [trace.band for trace in self.traces]
            del bands[place : place + 1]
            if code != "none":
                bands.insert(place, TrendBand(console.device, code))
            self._keep_bands(list(dict.fromkeys(bands)))

        title = f"drive {console.device}, band {place + 1}"
        self.app.push_screen(PickParameter(console.session.profile, None, title), picked)

    def action_pick_drive(self) -> None:
        """Ask for the address of a drive, then for a parameter of it."""
        from ..dialogs.address import AddressField

        fleet = self.app.fleet
        if fleet is None:
            return
        named = {
            device: drive.identity.name or drive.identity.reference or f"drive {device}"
            if drive.console is not None
            else None
            for device, drive in fleet.found.items()
        }

        def typed(address: int | None) -> None:
            console = None if address is None else fleet.console(address)
            if console is not None and self.is_current:
                self._pick(console)

        self.app.push_screen(AddressField(named), typed)

    def action_save_file(self) -> None:
        """Ask for a name, and save the page or the time between the marks as CSV and SVG."""
        from ..dialogs.ask import Ask, fault_of_new
        from .saving import SAVED_TREND_AS

        now, page = self.app.clock.wall(), self.page
        since, until = page.begins(now), page.ends(now)
        if page.mark_a is not None and page.mark_b is not None:
            since, until = sorted((page.mark_a, page.mark_b))
        name = time.strftime("trend-%Y%m%d-%H%M%S.csv", time.localtime(now))

        def reported(answer: str | None) -> None:
            if answer:
                self.run_worker(self._save(Path(answer).expanduser(), since, until))

        requested = Ask(
            "Save the trend as",
            fault_of_new,
            text=str(state_folder() / name),
            about=SAVED_TREND_AS,
            takes="Save",
        )
        self.app.push_screen(requested, reported)

    async def _save(self, path: Path, since: float, until: float) -> None:
        from .saving import save_trend

        try:
            count = await asyncio.to_thread(
                save_trend, path, self._files(), list(self.traces), since, until
            )
        except (OSError, sqlite3.Error) as error:
            why = getattr(error, "strerror", None) or error
            self.app.notify(f"Not saved: {why}: {path}", severity="error")
        else:
            self.app.tell(counted(count, *SAVED_BOTH, path=path.with_suffix(".csv")))
