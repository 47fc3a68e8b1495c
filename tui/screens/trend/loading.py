"""Bands of Trend: what they need is read live, and their record in a thread."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

from tui.drive.profile.schema import Quantity
from tui.session.connect.line_key import line_key
from tui.session.console import DriveConsole
from tui.session.monitor.live_trace import LiveTrace
from tui.session.monitor.trend import readout_parameter
from tui.session.monitor.trend_bands import TrendBand, store_bands
from tui.session.record.history import oldest_reply, recorded_events
from tui.session.record.schema import EventRow

from ..base import PanelScreen
from .event_list import events_shown
from .page import TrendPage
from .traces import (
    BandTrace,
    MarkValues,
    mark_values,
    reach_of_trace,
    read_traces,
    reference_code,
)

FIRST_BANDS: tuple[Quantity, ...] = ("output_frequency", "motor_current", "torque")
"""Bands of a line without stored ones, of the open drive."""
READ_BEFORE = 30.0
"""Seconds before a page or a mark that are read too, for curves and values that begin there."""


class TrendBands(PanelScreen):
    """Part of the screen that has the bands and their values."""

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self.page = TrendPage()
        self.traces: list[BandTrace] = []
        self._lives: dict[int, LiveTrace] = {}
        self._selected = 0
        self._recorded: Sequence[EventRow] = ()
        self._oldest: float | None = None
        """Begin of the record of these drives; None without any."""
        self._marks: dict[TrendBand, MarkValues] = {}
        self._loading = self._load_due = False
        self._drawn_page: tuple[float, float] | None = None
        """Start and span of the page for which the axes were made."""

    def on_unmount(self) -> None:
        """Read the bands no longer."""
        for live in self._lives.values():
            live.close()

    @property
    def _line_key(self) -> str:
        return line_key(self.session.line_text if self.app.opened is None else self.app.line_text)

    def _set_bands(self, bands: Sequence[TrendBand]) -> None:
        """Show these bands, and read what they need."""
        before = {trace.band: trace for trace in self.traces}
        self.traces = [
            before.get(band) or BandTrace(band, self._console_of(band.device)) for band in bands
        ]
        wanted: dict[int, list[str]] = {}
        for trace in self.traces:
            self._add_reference(trace)
        for trace in self._read:
            if trace.entry is not None:
                wanted.setdefault(trace.band.device, []).append(trace.band.code)
        past, self._lives = self._lives, {}
        for device, codes in wanted.items():
            known = past.get(device)
            if known is not None and set(known.codes) == set(codes):
                self._lives[device] = past.pop(device)
            elif (console := self._console_of(device)) is not None:
                self._lives[device] = LiveTrace(console.monitor, codes, self.app.period)
        for live in past.values():
            live.close()
        for trace in self._read:
            trace.live = self._lives.get(trace.band.device) if trace.entry is not None else None
        self._selected = min(self._selected, max(0, len(bands) - 1))
        self._marks = {}
        self._load()
        self._load_marks()
        self.look()

    def _add_reference(self, trace: BandTrace) -> None:
        """Give a band its reference; not on a low-bandwidth link, where each dot has its price."""
        console = trace.console
        if console is None or trace.reference is not None or self.app.low_bandwidth:
            return
        if code := reference_code(console.session.profile, trace.entry):
            trace.reference = BandTrace(TrendBand(trace.band.device, code), console)

    @property
    def _read(self) -> list[BandTrace]:
        """The bands and their references: what is read live and from the record."""
        references = (trace.reference for trace in self.traces)
        return [*self.traces, *(item for item in references if item is not None)]

    def _console_of(self, device: int) -> DriveConsole | None:
        if device == self.console.device:
            return self.console
        return self.app.fleet.console(device) if self.app.fleet is not None else None

    def _keep_bands(self, bands: Sequence[TrendBand]) -> None:
        store_bands(self._line_key, bands)
        self._set_bands(bands)

    def _files(self) -> list[Path]:
        try:
            return self.app.opened.recorded_files() if self.app.opened is not None else []
        except OSError:
            return []

    def _load(self) -> None:
        """Read the record of the page; again if the page changes in the meantime."""
        self._load_due = True
        if not self._loading:
            self._loading = True
            self.run_worker(self._load_due_pages(), group="trend", exit_on_error=False)

    async def _load_due_pages(self) -> None:
        try:
            while self._load_due:
                self._load_due = False
                await self._load_page()
        finally:
            self._loading = False
        self.look()

    async def _load_page(self) -> None:
        now, traces = self.app.clock.wall(), self._read
        start, until = self.page.begins(now) - READ_BEFORE, self.page.ends(now)
        files = self._files()
        found = await asyncio.to_thread(read_traces, files, traces, start, until)
        devices = frozenset(trace.band.device for trace in traces)
        self._oldest = await asyncio.to_thread(oldest_reply, files, devices)
        if self._oldest is not None:
            past = await asyncio.to_thread(recorded_events, files, self._oldest, until)
            self._recorded = events_shown(past, devices)
        for trace, history in zip(traces, found, strict=True):
            trace.take(history)
        self._drawn_page = None

    def _load_marks(self) -> None:
        if self.page.mark_a is not None and self.page.mark_b is not None:
            self.run_worker(
                self._read_marks(self.page.mark_a, self.page.mark_b),
                group="marks", exclusive=True, exit_on_error=False,
            )  # fmt: skip

    async def _read_marks(self, mark_a: float, mark_b: float) -> None:
        """Read every value from one mark to the other."""
        traces, (first, last) = list(self.traces), sorted((mark_a, mark_b))
        since = first - READ_BEFORE
        found = await asyncio.to_thread(read_traces, self._files(), traces, since, last)
        for trace, history in zip(traces, found, strict=True):
            points = list(history.points)
            after = points[-1].end + 1e-3 if points else since
            points += [point for point in trace.points if point.time > after and not point.reduced]
            self._marks[trace.band] = mark_values(points, mark_a, mark_b, reach_of_trace(trace))
        self.look()


def first_bands(console: DriveConsole) -> list[TrendBand]:
    """Return the bands of a line that has none: speed, current and torque of the open drive."""
    profile = console.session.profile
    found = (readout_parameter(profile, quantity) for quantity in FIRST_BANDS)
    return [TrendBand(console.device, entry.code) for entry in found if entry is not None]
