"""Control: the drive's commander, and the writes of another configuration."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.widgets import OptionList

from tui.bus.errors import LineClosed, LineError
from tui.bus.link import SerialLink
from tui.drive.channel import channel_codes, switch_texts
from tui.drive.chart import ENABLED_KINDS
from tui.drive.control_source import source_changes, source_codes, source_in_force
from tui.drive.profile.schema import ControlSource
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.proof.prover import Prover, hidden_at_rest
from tui.session.proof.result import proof_entry
from tui.session.timeout_report import TimeoutWatch
from tui.session.work import OutcomeKind, Permit, Task
from tui.widgets.drawing import rule, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.widgets.plain import entry

from ..command.command_keys import OrderKeys
from ..keys.action import SOURCES
from ..keys.table import bindings
from .view import change_lines, diagram, left_lines, note_lines, now_lines

if TYPE_CHECKING:
    from tui.session.fleet import Fleet

HOW_IT_IS_TESTED = (
    "Polling pauses for longer and longer, up to about the timeout, until the drive reacts. It is"
    " then in fault: press x on Monitor to reset it. The test takes about {seconds:.0f} s."
)
WITH_RUNNING_MOTOR = (
    "THE MOTOR IS RUNNING. It reacts as set, and may coast; a hoist load falls. A stop is sent"
    " when the test ends, or when you press a stop key. "
)
TIMEOUTS_PER_TEST = 4.6
"""Duration of a test in communication timeouts, if the drive reacts as set."""


def timeout_line(
    session: DriveSession, watch: TimeoutWatch | None, proved: str, width: int
) -> Text:
    """Return the drive's timeout reaction, the result of its test, and its line settings."""
    rules, link = session.profile.data.communication_fault, session.line.link
    reported = Text("  Timeout       ", FAINT, no_wrap=True)
    if rules is None:
        reported.append("none known", PLAIN)
    elif watch is None:
        reported.append(f"{rules.timeout or 'timeout'} off, or not read yet", ALARM)
    else:
        does = watch.reaction.name if watch.reaction else "its own reaction"
        reported.append(f"{rules.timeout} {watch.timeout:g} s, then ", STRONG)
        reported.append(does, STRONG if watch.trips else ALARM)
        reported.append(f" · {proved or 'not tested'}", PLAIN if proved else FAINT)
    reported.append(f" · address {session.device}", FAINT)
    if isinstance(link, SerialLink):
        reported.append(f" · {link.baud} {link.format}", FAINT)
    reported.truncate(width, overflow="ellipsis")
    return reported


def warning_lines(session: DriveSession, width: int) -> list[Text]:
    """Return the family's warnings about a communication loss."""
    rules = session.profile.data.communication_fault
    lines = []
    for warning in rules.warnings if rules else ():
        for at, line in enumerate(wrapped(warning, width - 7, 3)):
            text = Text(no_wrap=True)
            text.append("     " if at else "   ! ", ALARM)
            lines.append(text.append(line, FAINT))
    return lines


def ask_to_test(
    ask: Callable[[str, str, str, str, Callable[[int], object]], object],
    session: DriveSession,
    watch: TimeoutWatch | None,
    *,
    turning: bool,
    work: Callable[..., None],
) -> None:
    """Ask to start the test; `turning` warns of a running motor."""
    seconds = TIMEOUTS_PER_TEST * watch.timeout if watch is not None else 0.0
    how = (
        HOW_IT_IS_TESTED.format(seconds=seconds)
        if watch is not None
        else HOW_IT_IS_TESTED.partition(" The test takes")[0]
    )
    ask(
        f"Test how drive {session.device} reacts to a communication loss?",
        (WITH_RUNNING_MOTOR if turning else "") + how,
        "Test",
        "Cancel",
        partial(work, turning=turning),
    )


def begin_test(fleet: Fleet, console: DriveConsole, stamp: int, *, turning: bool) -> None:
    """Put the test into the drive's work queue. Raises OrderRefused."""
    session, working = console.session, "Communication loss test: polling is paused."

    async def carry_out(permit: Permit) -> str:
        def tell(text: str) -> None:
            # in the place of what is told of the work, which stands before all that was said
            session.work.report(OutcomeKind.WORKING, f"Test: {text} Polling is paused.")

        prover = Prover(session, console.journal, permit, turning, tell)
        try:
            result = await prover.prove()
            console.journal.add(proof_entry(session, result))
            console.proved = result.short
            text = f"Test: {result.text} {result.changed}".rstrip()
            if turning:
                # now, because the stop ends this work
                fleet.events.add("done" if result.as_set else "failed", text, session.device)
        finally:
            if turning and permit.stamp == session.work.stops:
                with suppress(LineClosed):
                    fleet.stop([session], by="the end of the test")
        return "" if turning else text

    session.work.put(Task(carry_out, owner=console, working=working), stamp)


class ControlSourceScreen(OrderKeys):
    """The configurations of a family; Enter writes the chosen one, if armed and at standstill."""

    CSS_PATH = "control.tcss"
    BINDINGS: ClassVar = bindings(SOURCES)
    TITLE = "Control"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._sources = self.session.profile.data.control_sources
        self._raws: dict[str, int] = {}
        self._trouble = "reading the configuration"
        self._seen: object = None

    def body(self) -> ComposeResult:
        """Commander and timeout, the list, the details of the chosen configuration."""
        yield Lines(id="now")
        yield OptionList(id="sources", compact=True)
        yield Lines(id="detail")

    def on_mount(self) -> None:
        """Show the list, and read the present configuration."""
        self._list()
        self.query(OptionList).focus()
        self.run_worker(self._read(), exclusive=True, group="sources")

    async def _read(self) -> None:
        try:
            profile = self.session.profile
            codes = [*source_codes(profile), *channel_codes(profile)]
            readings = await self.console.read(dict.fromkeys(codes))
        except LineError as error:
            self._trouble = str(error)
        else:
            self._raws = {c: r.raw for c, r in readings.items() if r.raw is not None}
            bad = [r for r in readings.values() if r.raw is None]
            self._trouble = f"{bad[0].parameter.code}: {bad[0].error}" if bad else ""
        self._list()
        self.look()

    def _list(self) -> None:
        """List the configurations, with a mark at the active one."""
        if not (found := self.query(OptionList)):
            return  # the screen was left before it was composed
        today = source_in_force(self.session.profile, self._raws)
        options = found.first()
        at = options.highlighted
        if at is None:
            at = self._sources.index(today) if today else 0
        options.clear_options()
        for source in self._sources:
            text = Text(no_wrap=True)
            text.append(" ● " if source is today else " · ", STRONG if source is today else FAINT)
            text.append(source.name, STRONG if source is today else PLAIN)
            text.append("   active" if source is today else "", FAINT)
            options.add_option(entry(text))
        options.highlighted = at

    @property
    def _chosen(self) -> ControlSource:
        return self._sources[self.query_one(OptionList).highlighted or 0]

    def on_option_list_option_highlighted(self) -> None:
        """Show the details of the configuration under the cursor."""
        self.look()

    def draw(self, width: int) -> None:
        """Draw the commander, the timeout, and the chosen configuration."""
        super().draw(width)
        found = source_changes(self.session.profile, self._chosen, self._raws)
        lines = [rule("Signal path of the selected configuration", width), *diagram(self._chosen)]
        lines.append(rule("Enter writes", width))
        if self._raws:
            lines += change_lines(self.session.profile, found, width)
        notes = note_lines(self._chosen, found, width)
        room = self.query_one("#detail").size.height
        lines += [*([Text("")] if len(lines) + len(notes) < room else []), *notes]
        if warnings := warning_lines(self.session, width):
            lines += [Text(""), rule("On a communication loss", width), *warnings]
        self.put("detail", lines)
        self.put_all("now", self._now(width))
        outcome = self.commander.outcome
        if outcome is not None and outcome is not self._seen and outcome.kind != "working":
            self._seen = outcome
            self.run_worker(self._read(), exclusive=True, group="sources")

    def _now(self, width: int) -> list[Text]:
        profile, latest = self.session.profile, self.console.latest
        switches = switch_texts(profile, self._raws)
        lines = now_lines(profile, self._today(), latest, self._trouble, switches, width)
        silence = timeout_line(self.session, self._watch(), self.console.proved, width)
        fleet = self.app.fleet
        left = fleet.left_behind(self.console) if fleet is not None else ""
        return [lines[1], *left_lines(left, width), silence, *lines[2:]]

    def _watch(self) -> TimeoutWatch | None:
        """The drive's communication timeout, once it has been read."""
        fleet = self.app.fleet
        return fleet.line_watch.watch(self.session.device) if fleet is not None else None

    def _today(self) -> ControlSource | None:
        """The active configuration; None if it is not listed, or was not read."""
        return source_in_force(self.session.profile, self._raws) if self._raws else None

    def on_option_list_option_selected(self) -> None:
        """Write on Enter in the list."""
        self.action_write_chosen()

    def action_prove(self) -> None:
        """Ask, then test the drive's reaction to a communication loss."""
        latest = self.console.latest
        if not self._require_armed() or latest is None:
            return
        turning, watch = latest.state.motion in ENABLED_KINDS, self._watch()
        if not turning and watch is not None and (why := hidden_at_rest(watch.reaction)):
            self._refuse(why)
            return
        ask_to_test(self._ask, self.session, watch, turning=turning, work=self._prove)

    def _prove(self, stamp: int, *, turning: bool) -> None:
        """Queue the test; its result is recorded and reported."""
        fleet = self.app.fleet
        if fleet is not None:
            begin_test(fleet, self.console, stamp, turning=turning)
        self.look()

    def action_write_chosen(self) -> None:
        """Ask, then write the chosen configuration."""
        found = source_changes(self.session.profile, self._chosen, self._raws)
        if not self._raws:
            self._refuse("The configuration has not been read yet.")
        elif not found:
            self._refuse("Nothing to write: this configuration is active.")
        elif self._require_armed():
            codes = ", ".join(change.parameter.code for change in found)
            follows = (
                f"Writes {codes}, each read back. A run command present at the new source"
                " starts the motor."
            )
            work = partial(self.commander.configure, self._chosen)
            name = self._chosen.name
            self._ask(f"Switch to {name}?", follows, "Write", "Cancel", work)
        self.look()
