"""Control: the drive's commander, and the writes of another configuration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.widgets import OptionList

from tui.bus.errors import LineClosed, LineError
from tui.bus.link import SerialLink
from tui.drive.channel import switch_texts
from tui.drive.chart import ENABLED_KINDS
from tui.drive.control_source import SourceChange, source_changes, source_codes, source_in_force
from tui.drive.profile.schema import ControlSource
from tui.drive.sentences import sentence, uncapitalized
from tui.drive.signal_path import LineStep
from tui.session.console import DriveConsole
from tui.session.control_paths import ControlPaths
from tui.session.drive import DriveSession
from tui.session.proof.prover import Prover, hidden_at_rest
from tui.session.proof.result import proof_entry
from tui.session.timeout_report import TimeoutWatch
from tui.session.work import OutcomeKind, Permit, Task
from tui.widgets.drawing import rule, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, STATE_STYLES, STRONG
from tui.widgets.plain import entry

from ..command.command_keys import OrderKeys
from ..keys.action import SOURCES
from ..keys.table import bindings
from .switch_view import LEAST_HEIGHT, LEAST_WIDTH, drawing, hints, written_paths
from .view import (
    change_lines,
    headed_lines,
    left_lines,
    note_lines,
    now_lines,
    short_changes,
    source_row,
    step_row,
)

if TYPE_CHECKING:
    from tui.session.fleet import Fleet

HOW_IT_IS_TESTED = "Polling pauses for longer and longer, up to about the timeout, until it reacts."
WITH_RUNNING_MOTOR = (
    "THE MOTOR IS RUNNING. It reacts as set, and may coast; a hoist load falls. A stop is sent"
    " when the test ends, or when you press a stop key."
)
PROPOSES = "Proposes the value on Parameters. Press w there to write it."
FRAME_ROWS = 4
"""Rows of the status bar, the tabs, the message and the key bar."""
LEAST_LISTED, LEAST_DETAIL = 2, 5
"""Rows of the list, and of the details below it, at least."""
REREAD_EVERY = 2.0
"""Seconds between two reads of the configuration; another program may change it."""
TIMEOUTS_PER_TEST = 4.6
"""Duration of a test in communication timeouts, if the drive reacts as set."""


def timeout_lines(
    session: DriveSession, watch: TimeoutWatch | None, proved: str, width: int, *, whole: bool
) -> list[Text]:
    """Return the drive's timeout reaction and the result of its test; its line too if `whole`."""
    rules, link = session.profile.data.communication_fault, session.line.link
    parts: list[tuple[str, Style]] = []
    if rules is None:
        parts.append(("none known", PLAIN))
    elif watch is None:
        parts.append((f"{rules.timeout or 'timeout'} off, or not read yet", ALARM))
    else:
        does = watch.reaction.name if watch.reaction else "its own reaction"
        style = STRONG if watch.trips else ALARM
        parts.append((f"{rules.timeout} {watch.timeout:g} s, then {does}", style))
        parts.append((proved or "not tested", PLAIN if proved else FAINT))
    if whole:
        parts.append((f"address {session.device}", FAINT))
    if whole and isinstance(link, SerialLink):
        parts.append((f"{link.baud} {link.format}", FAINT))
    return headed_lines("Timeout", parts, width)


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
    reaction = watch.reaction if watch is not None else None
    parts = [*([WITH_RUNNING_MOTOR] if turning else []), HOW_IT_IS_TESTED]
    if reaction is not None:
        does = uncapitalized(sentence(reaction.does))
        parts.append(f"It should react with {reaction.name}: {does}")
    if watch is None or watch.trips:
        then = "is then" if reaction is not None else "may then be"
        parts.append(f"It {then} in fault: press x on Monitor to reset it.")
    if watch is not None:
        parts.append(f"The test takes about {TIMEOUTS_PER_TEST * watch.timeout:.0f} s.")
    ask(
        f"Test how drive {session.device} reacts to a communication loss?",
        " ".join(parts),
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


def fitted(lines: list[Text], room: int) -> list[Text]:
    """Return the lines that fit, with a sign at the last one if there are more."""
    if len(lines) <= room or room < 2:
        return lines[: max(0, room)]
    return [*lines[: room - 1], lines[room - 1].copy().append(" …", FAINT)]


class ControlSourceScreen(OrderKeys):
    """The steps to this line and the configurations of a family, in one list.

    Enter opens the parameter of a step, or writes a configuration, if armed and at standstill.
    """

    CSS_PATH = "control.tcss"
    BINDINGS: ClassVar = bindings(SOURCES)
    TITLE = "Control"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._sources = self.session.profile.data.control_sources
        self._paths = ControlPaths(self.session)
        self._trouble = "reading the configuration"
        self._seen: object = None
        self._rows: tuple[LineStep | ControlSource, ...] = ()
        """Contents of the list: steps that make this line a source, then configurations."""
        self._listed: object = self
        """Contents of the list at its last update; this screen before the first."""
        self._placed: int | None = None
        """Row on which this screen put the cursor; on another one, a person has moved it."""

    def body(self) -> ComposeResult:
        """Commander and timeout, the signal paths, the list, and the details of its choice."""
        yield Lines(id="now")
        yield Lines(id="paths")
        yield OptionList(id="sources", compact=True)
        yield Lines(id="detail")

    def on_mount(self) -> None:
        """Show the list, and read the present configuration again and again."""
        self._list()
        self.query_one(OptionList).focus()
        self._read_again(again=False)
        self.set_interval(REREAD_EVERY, self._read_again)

    def _read_again(self, *, again: bool = True) -> None:
        """Read the configuration, unless this is in progress; a poll if `again`."""
        if not any(worker.group == "sources" and worker.is_running for worker in self.workers):
            self.run_worker(self._read(again=again), group="sources")

    async def _read(self, *, again: bool) -> None:
        try:
            readings = await self.console.read(self._paths.codes, again=again)
        except LineError as error:
            self._trouble = str(error)
        else:
            bad = [r for r in readings.values() if r.raw is None]
            self._trouble = f"{bad[0].parameter.code}: {bad[0].error}" if bad else ""
        self._list()
        self.look()

    @property
    def _raws(self) -> Mapping[str, int]:
        """Current raw values; none before all words of the configurations were read."""
        raws = self._paths.raws
        return raws if all(code in raws for code in source_codes(self.session.profile)) else {}

    def _list(self) -> None:
        """List the steps and the configurations, with a mark at the active one."""
        if not (found := self.query(OptionList)):
            return  # the screen was left before it was composed
        today, steps, staged = self._today(), self._paths.steps, self._staged
        if (today, steps, staged) == self._listed:
            return
        self._listed = (today, steps, staged)
        options, chosen = found.first(), self._chosen
        moved = options.highlighted != self._placed
        self._rows = (*steps, *self._sources)
        first = steps[0] if steps else today
        kept = chosen if moved and chosen in self._rows else first
        options.clear_options()
        options.display = bool(self._rows)
        lines = [
            step_row(row, staged=row.change in staged)
            if isinstance(row, LineStep)
            else source_row(row, active=row is today)
            for row in self._rows
        ]
        options.add_options([entry(line) for line in lines])
        if self._rows:
            options.highlighted = self._rows.index(kept) if kept in self._rows else 0
        self._placed = None if moved else options.highlighted

    @property
    def _staged(self) -> list[SourceChange | None]:
        """The changes of the steps that are staged on Parameters."""
        if (editor := self.console.begun_editor) is None:
            return []
        edits = editor.staging.edits
        changes = (step.change for step in self._paths.steps)
        return [c for c in changes if c and (e := edits.get(c.parameter.code)) and e.new == c.new]

    @property
    def _chosen(self) -> LineStep | ControlSource | None:
        at = self.query_one(OptionList).highlighted or 0
        return self._rows[at] if at < len(self._rows) else None

    def on_option_list_option_highlighted(self) -> None:
        """Show the details of the configuration under the cursor."""
        self.look()

    def draw(self, width: int) -> None:
        """Draw the commander, the timeout, the signal paths, and the chosen configuration."""
        super().draw(width)
        self._list()
        now, paths = self._now(width), self._drawn_paths(width)
        self.put_all("now", now)
        self.put_all("paths", paths)
        room = self.size.height - FRAME_ROWS - len(now) - len(paths)
        if self._rows:
            rows = max(LEAST_LISTED, min(len(self._rows), room - LEAST_DETAIL))
            options = self.query_one(OptionList)
            if options.size.height != rows:
                options.styles.height = rows
            room -= rows
        self.put("detail", fitted(self._detail(width, room), room))
        outcome = self.commander.outcome
        if outcome is not None and outcome is not self._seen and outcome.kind != "working":
            self._seen = outcome
            self._read_again(again=False)

    @property
    def _is_drawn(self) -> bool:
        """True if the terminal has room for the drawing."""
        return self.size.width >= LEAST_WIDTH and self.size.height >= LEAST_HEIGHT

    def _drawn_paths(self, width: int) -> list[Text]:
        """The paths as a drawing if there is room, else in words, and the ways to this line."""
        if not self._is_drawn:
            return [*written_paths(self._paths, width), *hints(self._paths, width)]
        latest, speed, style = self.console.latest, "", FAINT
        parameter = self.session.profile.quantity("output_frequency")
        if latest is not None and parameter is not None:
            reading = latest.readings.get(parameter.code)
            number = None if reading is None or latest.error else reading.current_number
            speed = "-----" if number is None else f"{number:z.1f}"
            style = STATE_STYLES.get(latest.state.kind, PLAIN) if number is not None else FAINT
        lines = drawing(self._paths, speed, style, width)
        return [*lines, *hints(self._paths, width)]

    def _detail(self, width: int, room: int) -> list[Text]:
        """The chosen configuration with its writes and notes, and the family's warnings."""
        warnings = warning_lines(self.session, width)
        lines: list[Text] = []
        chosen = self._chosen
        if isinstance(chosen, LineStep) and chosen.change is not None:
            writes = change_lines(self.session.profile, [chosen.change], width)
            notes = [Text(f"   {line}", FAINT) for line in wrapped(PROPOSES, width - 4, 2)]
            lines = [rule("Enter opens the parameter", width), *writes, *notes]
        elif isinstance(chosen, ControlSource):
            found = source_changes(self.session.profile, chosen, self._raws)
            notes = note_lines(chosen, found, width)
            writes = change_lines(self.session.profile, found, width) if self._raws else []
            if writes and 1 + len(writes) + min(1, len(notes)) > room:
                writes = short_changes(self.session.profile, found, width)
            lines = [rule("Enter writes the selected configuration", width), *writes, *notes]
        if warnings and len(lines) + 2 + len(warnings) <= room:
            lines += [Text(""), rule("On a communication loss", width), *warnings]
        return lines

    def _now(self, width: int) -> list[Text]:
        profile, latest = self.session.profile, self.console.latest
        drawn = {switch.parameter for path in profile.data.signal_paths for switch in path.switches}
        switches = switch_texts(profile, self._raws, drawn)
        whole, today = self._is_drawn, self._today()
        head, more = now_lines(profile, today, latest, self._trouble, switches, width, whole=whole)
        silence = timeout_lines(
            self.session, self._watch(), self.console.proved, width, whole=whole
        )
        fleet = self.app.fleet
        left = fleet.left_behind(self.console) if fleet is not None else ""
        return [*head, *left_lines(left, width), *silence, *more]

    def _watch(self) -> TimeoutWatch | None:
        """The drive's communication timeout, once it has been read."""
        fleet = self.app.fleet
        return fleet.line_watch.watch(self.session.device) if fleet is not None else None

    def _today(self) -> ControlSource | None:
        """The active configuration; None if it is not listed, or was not read."""
        return source_in_force(self.session.profile, self._raws) if self._raws else None

    async def on_option_list_option_selected(self) -> None:
        """Open the parameter of a step, or write a configuration."""
        if isinstance(chosen := self._chosen, LineStep) and chosen.change is not None:
            await self.app.open_parameter(chosen.change.parameter.code, chosen.change.new)
        else:
            self.action_write_chosen()

    def action_other_page(self) -> None:
        """Show the communication map."""
        from .map_screen import MapScreen

        self.app.push_screen(MapScreen(self.console))

    def action_prove(self) -> None:
        """Ask, then test the drive's reaction to a communication loss."""
        latest = self.console.latest
        if not self._may_write() or latest is None:
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
        if not isinstance(chosen := self._chosen, ControlSource):
            return
        found = source_changes(self.session.profile, chosen, self._raws)
        if not self._raws:
            self._refuse("The configuration has not been read yet.")
        elif not found:
            self._refuse("Nothing to write: this configuration is active.")
        elif self._may_write():
            codes = ", ".join(change.parameter.code for change in found)
            follows = (
                f"Writes {codes}, each read back. A run command present at the new source"
                " starts the motor."
            )
            work = partial(self.commander.configure, chosen)
            self._ask(f"Switch to {chosen.name}?", follows, "Write", "Cancel", work)
        self.look()
