"""Monitor: what the motor does, at one glance."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal, InvalidOperation
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.events import Resize
from textual.timer import Timer

from tui.drive.profile.schema import Parameter
from tui.screens.monitor.motor import motor_lines
from tui.screens.monitor.state import (
    header,
    history_lines,
    line_lines,
    message_lines,
    panel_lines,
    state_lines,
)
from tui.screens.monitor.trends import stacked_trends, trend_lines
from tui.screens.monitor.view import SPANS, USUAL_SPAN, View
from tui.screens.monitor.words import bit_lines, word_pages
from tui.session.command.stop_report import Phase, StopReport
from tui.session.console import DriveConsole
from tui.session.reading import Rating
from tui.widgets.lines import Lines

from ..keys.table import MONITOR, bindings, keys_line
from .commands import order_keys
from .run_keys import RunKeys

REFRESH = 0.25
"""Seconds between two looks at the latest snapshot; the line polls at its own pace."""
LOW_BANDWIDTH_REFRESH = 2.0
STILL_TOLD = 5.0
"""Seconds under a dialog after which it is told that the values below it stand still."""
STOP_TOLD = {Phase.STOPPED: 10.0, Phase.FAILED: 60.0}
"""Seconds for which the end of a stop is shown."""
WIDE_WORDS = (110, 36)
"""Columns and rows from which all words stand side by side."""
PERIODS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
SMALL_LEFT = 32
WIDE_LEFT = 34
WORD_WIDTH = 30
WORDS_HEIGHT = 16
WIDE_MOTOR = 46


class MonitorScreen(RunKeys):
    """One drive, watched live; the screen only looks at what the line's worker brought."""

    CSS_PATH = "monitor.tcss"
    BINDINGS: ClassVar = bindings(MONITOR)
    TITLE = "Monitor"

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._word = 0
        self._span = SPANS.index(USUAL_SPAN)
        self._timer: Timer | None = None
        self._still: Timer | None = None
        self._busy: tuple[float, float] | None = None
        self._load = 0.0
        self._was = ""

    def body(self) -> ComposeResult:
        """Fixed places, filled by lines."""
        yield Lines(id="header")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield Lines(id="state")
                yield Lines(id="word")
                yield Lines(id="history")
            with Vertical(id="right"):
                yield Lines(id="motor")
                yield Lines(id="trend")
        with Horizontal(id="words"):
            for index in range(4):
                yield Lines(id=f"word{index}", classes="word")
        yield Lines(id="message")
        yield Lines(id="status")

    def on_mount(self) -> None:
        """Start watching."""
        self.console.monitor.start(period=self.app.period, extra=self._extras())
        self._timer = self.set_interval(
            LOW_BANDWIDTH_REFRESH if self.app.low_bandwidth else REFRESH, self.look
        )

    def on_unmount(self) -> None:
        """Stop watching; nobody looks any more, and nothing is commanded any more."""
        self.commander.disarm()
        self.console.monitor.stop()

    def on_resize(self, event: Resize) -> None:
        """More room, more words."""
        self.set_class(
            event.size.width >= WIDE_WORDS[0] and event.size.height >= WIDE_WORDS[1], "wide"
        )

    def on_screen_suspend(self) -> None:
        """Stand still while another screen is on top.

        What stirs below a screen makes Textual draw the whole terminal again.
        """
        if self._timer is not None:
            self._timer.pause()
            since = self.app.clock.time_of_day()
            self._still = self.set_timer(STILL_TOLD, lambda: self._tell_still(since))

    def _tell_still(self, since: str) -> None:
        """Nobody shall take what shines through under a dialog for the present."""
        if self.app.screen.styles.background.a < 1:
            view = replace(self._view(), clock=f"as of {since}")
            self.put("header", header(view, self.size.width))

    def on_screen_resume(self) -> None:
        """Look again after another screen was on top."""
        if self._still is not None:
            self._still.stop()
        if self._timer is not None:
            self._timer.resume()
        self.call_after_refresh(self.look)

    @property
    def wide(self) -> bool:
        """Whether all words stand side by side."""
        return self.has_class("wide")

    def draw(self, width: int) -> None:
        """Show the latest snapshot; which keys work now depends on it."""
        self._put_all(self._parts(self._view(), width))
        self.ask_unrecorded()

    def _put_all(self, parts: dict[str, list[Text]]) -> None:
        for place, lines in parts.items():
            self.put(place, lines)

    def _view(self) -> View:
        now = self.app.clock.monotonic()
        monitor = self.console.monitor
        counters = self.session.line.counters
        self._measure_load(now, counters.busy_seconds)
        snapshot = monitor.latest
        if snapshot is not None and not snapshot.error and snapshot.state.kind != "unknown":
            self._was = snapshot.state.headline
        return View(
            profile=self.session.profile,
            identity=self.session.identity,
            device=self.session.device,
            line_label=self.app.line_label,
            snapshot=snapshot,
            line=self.session.line.state,
            counters=counters,
            load=self._load,
            trend=monitor.trend,
            period=monitor.period,
            now=now,
            clock=self.app.clock.time_of_day(),
            read_only=self.app.read_only,
            low_bandwidth=self.app.low_bandwidth,
            watch=self.app.fleet.line_watch.watch(self.session.device) if self.app.fleet else None,
            heard=self.session.line.device_state(self.session.device).heard,
            control=self.control(now),
            stop=self._stop(now),
            was=self._was,
            span=SPANS[self._span],
            unseen=not self.console.recorder.seen,
        )

    def _stop(self, now: float) -> StopReport | None:
        """What a stop of this drive has come to; a good end is told for a while only."""
        fleet = self.app.fleet
        report = fleet.stopper.reports.get(self.session.device) if fleet else None
        if report is None or self._is_overtaken(report):
            return None
        return report if now - report.since < STOP_TOLD.get(report.phase, now) else None

    def _is_overtaken(self, report: StopReport) -> bool:
        """Whether something newer is true: a later command, or a motor that runs again."""
        outcome, latest = self.session.work.outcome, self.console.latest
        if outcome is not None and outcome.time > report.since:
            return True
        runs = latest is not None and not latest.error and latest.state.kind == "running"
        return runs and report.phase is Phase.STOPPED

    def _measure_load(self, now: float, busy: float) -> None:
        """Share of the last seconds in which the line was busy."""
        if self._busy is None:
            self._busy = (now, busy)
            return
        since, before = self._busy
        if now - since >= 2.0:
            self._load = min(1.0, max(0.0, (busy - before) / (now - since)))
            self._busy = (now, busy)

    def _parts(self, view: View, width: int) -> dict[str, list[Text]]:
        height = self.size.height
        left = WIDE_LEFT if self.wide else SMALL_LEFT
        right = max(20, width - left - 1)
        parts = {
            "header": header(view, width),
            "state": state_lines(view, left),
            "message": self.run_line_lines(view.now, width) or message_lines(view, width),
            "status": panel_lines(view, width),
            "keys": [order_keys(view, keys_line(MONITOR, width, self.app.stops_whom))],
        }
        body = height - (WORDS_HEIGHT if self.wide else 0) - 5
        rest = body - len(parts["state"])
        if self.wide:
            parts["motor"] = motor_lines(view, WIDE_MOTOR, body)
            parts["trend"] = stacked_trends(view, right - WIDE_MOTOR - 1, body)
            parts["history"] = history_lines(view, left, rest)
            parts["word"] = []
            return parts | self._wide_words(view, WORDS_HEIGHT)
        motor = motor_lines(view, right, body - 4)
        parts["motor"] = [*motor, Text("")]
        parts["trend"] = trend_lines(view, right, max(3, body - len(motor) - 1))
        parts["history"] = []
        return parts | self._small_word(view, rest)

    def _small_word(self, view: View, height: int) -> dict[str, list[Text]]:
        """The chosen word; always as many lines, as a change of height lays all out anew."""
        pages = word_pages(self._words(), height - 1)
        page = pages[self._word % len(pages)] if pages else None
        lines = bit_lines(view, page, SMALL_LEFT) if page else []
        return {"word": lines + [Text("")] * (height - len(lines))}

    def _wide_words(self, view: View, height: int) -> dict[str, list[Text]]:
        """Three words from the chosen one on, and the counters of the line."""
        parts: dict[str, list[Text]] = {}
        pages = word_pages(self._words(), height - 1)
        for index in range(3):
            shown = index < len(pages)
            page = pages[(self._word + index) % len(pages)] if shown else None
            parts[f"word{index}"] = bit_lines(view, page, WORD_WIDTH - 1) if page else []
        parts["word3"] = line_lines(view, WORD_WIDTH - 1, height)
        return parts

    def _words(self) -> list[Parameter]:
        """Words with named bits: the monitoring set's, then inputs and outputs."""
        profile = self.session.profile
        watched = [profile[v.parameter] for v in profile.data.monitoring.values]
        found = [parameter for parameter in watched if parameter.bits]
        for quantity in ("digital_inputs", "digital_outputs"):
            parameter = profile.quantity(quantity)
            if parameter is not None and parameter.bits and parameter not in found:
                found.append(parameter)
        return sorted(found, key=lambda p: p.quantity != "status_word")

    def _extras(self) -> list[str]:
        """What is read seldom: ends of bars, channels, history, inputs and outputs."""
        profile = self.session.profile
        codes = [v.high for v in profile.data.monitoring.values if profile.get(v.high)]
        for quantity in ("command_channel", "reference_channel"):
            parameter = profile.quantity(quantity)
            if parameter is not None:
                codes.append(parameter.code)
        codes += profile.data.faults.history
        codes += [parameter.code for parameter in self._words()]
        return list(dict.fromkeys(codes))

    def action_change_rate(self, step: int) -> None:
        """A faster or slower poll, out of a fixed row of rates."""
        now = PERIODS.index(min(PERIODS, key=lambda p: abs(p - self.app.period)))
        self.app.period = PERIODS[max(0, min(len(PERIODS) - 1, now - step))]
        self.console.monitor.period = self.app.period
        self.look()

    def action_trend_window(self, step: int) -> None:
        """A longer or shorter window of the trend."""
        self._span = max(0, min(len(SPANS) - 1, self._span + step))
        self.look()

    def action_next_word(self) -> None:
        """The next word of bits."""
        self._word += 1
        view = self._view()
        if self.wide:
            self._put_all(self._wide_words(view, WORDS_HEIGHT))
        else:
            height = self.query_one("#left").size.height
            self._put_all(self._small_word(view, height - len(state_lines(view, SMALL_LEFT))))

    def action_rating(self) -> None:
        """Tell the rated current of a drive that gives its current in %."""
        from ..dialogs.ask import Ask

        current = self.session.profile.quantity("motor_current")
        if current is None or current.unit != "%":
            self.app.notify("This drive gives its current in A.", timeout=3)
            return

        def told(text: str | None) -> None:
            if text:
                rated = Rating(Decimal(text.replace(",", ".")), "A")
                self.session.ratings[current.code] = rated
                self.look()

        about = f"100 % of {current.code}, from the nameplate of the drive; base: " + (
            current.base or "not confirmed by a manual"
        )
        asked = Ask("Rated current in A", fault_of_rating, about=about, number=True)
        self.app.push_screen(asked, told)


def fault_of_rating(text: str) -> str:
    """What is wrong with a typed rated current, or nothing."""
    try:
        number = Decimal(text.strip().replace(",", "."))
    except InvalidOperation:
        return f"{text!r} is no number. Write it like 9.1."
    return "" if 0 < number < 10000 else "A rated current is between 0 and 10 000 A."
