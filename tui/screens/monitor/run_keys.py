"""Keys of the run line, and of the inputs of a simulated drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING

from rich.style import Style
from rich.text import Text
from textual.events import Key

from tui.bus.errors import LineError
from tui.session.command.reference import reference_codes
from tui.session.drive_state import with_direction
from tui.session.shown import Shown
from tui.terminal.names import unshifted_digit
from tui.terminal.stroke import stroke_of
from tui.widgets.drawing import key_line, key_styles
from tui.widgets.palette import FAINT

from ..command.command_keys import OrderKeys
from ..command.control import hindrance
from ..keys.table import ACTIONS
from .run_line import STEPS, Purpose, RunLine, limits, proposed, run_lines

if TYPE_CHECKING:
    from tui.simulator import Bench

OTHER_STOP_KEYS = frozenset(item.keys for item in ACTIONS if item.id.startswith("stop_as("))
"""Keys of other stops, such as quick stop; they act immediately."""

ENTER_TOO_EARLY = "Enter ignored: it came before the line could be read. Press it again."


class RunKeys(OrderKeys):
    """Keys of the run line: r, v and f only open it, so no letter alone starts a motor."""

    _line: RunLine | None = None
    _around: Mapping[str, Shown] | None = None
    """Readings of the limits and the ramp, by code; None until they are read."""

    def action_run_line(self, purpose: Purpose) -> None:
        """Open the run line if the drive is armed.

        Refuse a reference if the profile has no parameter for it.
        """
        if not self._require_armed():
            return
        profile, image = self.session.profile, self.session.image
        wanted = self.commander.given.wanted
        text, unit = proposed(profile, wanted.text if wanted else "", image.raws, image.lacking)
        if purpose == "reference" and not unit:
            self._refuse(f"{profile.name} has no known parameter for its reference.")
            return
        now = self.app.clock.monotonic()
        self._line = RunLine(purpose, text, unit, now, self.session.work.stops)
        self._around = None
        self.run_worker(self._read_around(), exclusive=True, group="run line")
        self.look()

    async def _read_around(self) -> None:
        """Read the limits of the reference and the ramp times; ignore line errors."""
        profile = self.session.profile
        codes = reference_codes(profile)
        ramps = (profile.quantity("acceleration"), profile.quantity("deceleration"))
        codes += [ramp.code for ramp in ramps if ramp is not None]
        try:
            self._around = await self.console.read(codes)
        except LineError:
            return  # the line shows known values; Enter reads them again
        self.look()

    @property
    def line_is_open(self) -> bool:
        """True while keys act on the run line."""
        return self._line is not None

    @property
    def takes_letters(self) -> bool:
        """True while the run line, a dialog or a field accepts characters."""
        return self.line_is_open or super().takes_letters

    def run_line_lines(self, now: float, width: int) -> list[Text] | None:
        """Return the rows of the run line, in `width` cells; None while it is closed."""
        line = self._line
        if line is None:
            return None
        if line.stamp != self.session.work.stops or not self._armed():
            self._line = None  # a stop or disarming closes the line
            return None
        found = hindrance(self.session.profile, self.session.image.raws)
        reported = f"{found.text} {_after_esc(found.way)}" if found else ""
        around, output = self._around or {}, self._output()
        return run_lines(line, self.session.profile, around, now, width, reported, output)

    def run_line_keys(self, now: float) -> Text:
        """Return the keys that work while the line is open; Enter is dim until it counts."""
        line = self._line
        does = "set" if line is not None and line.purpose == "reference" else "run"
        counts = line is not None and line.counts(now)

        def styles(action: str) -> tuple[Style, Style]:
            return (FAINT, FAINT) if action == "enter" and not counts else key_styles(action)

        keys = [("stop_by_space", "Space", self.app.stop_target_text), ("enter", "Enter", does)]
        return key_line([*keys, ("close", "Esc", "cancel")], styles)

    def on_key(self, event: Key) -> None:
        """Handle keys of the open line; an unknown key closes it.

        Stop keys close the line too, but act as usual.
        """
        if self._line is None:
            super().on_key(event)
            return
        line, key = self._line, event.key
        self._line = None
        if key in OTHER_STOP_KEYS:
            self.look()
            return  # not consumed: a stop key acts here too
        event.stop()
        event.prevent_default()
        if key in STEPS and line.unit:
            if not _steps(event):
                self._line = line
                return
            low, high, _ = limits(self.session.profile, self._around or {})
            self._line = line.stepped(key, low, high)
        elif key == "backspace":
            self._line = line.erased()
        elif key == "enter":
            self._line = self._entered(line, event)
        elif (
            event.character and (typed := line.typed(unshifted_digit(event.character))) is not None
        ):
            self._line = typed
        self.look()

    def _entered(self, line: RunLine, event: Key) -> RunLine | None:
        """Give the command of the line and return None, which closes the line.

        Return the line if Enter came too early or in a burst, or if the reference is wrong.
        """
        if not line.counts(self.app.clock.monotonic()) or not _alone(event):
            self.app.tell(ENTER_TOO_EARLY)
            return line
        checked = line.checked(self.session.profile, self._around or {})
        if checked.fault:
            return checked
        commander, stamp = self.commander, line.stamp
        if (way := line.purpose) == "reference":
            self._give(lambda: commander.refer(line.reference or "", stamp))
        else:
            self._give(lambda: commander.run(way, line.reference, stamp))
        return None

    @property
    def takes_text(self) -> bool:
        """True while the line is open: digits that arrive together may be typed text."""
        return self._line is not None

    def action_step_reference(self, steps: int) -> None:
        """Raise or lower the reference; if that would start the motor, open the line instead."""
        if self._would_start() and self._armed():
            self.action_run_line("reference")
            if self._line is not None:
                key = next(k for k, step in STEPS.items() if step == steps)
                self._line = replace(self._line.stepped(key, None, None), fresh=True)
                self.look()
            return
        super().action_step_reference(steps)

    def _would_start(self) -> bool:
        """Return True if the drive is enabled at 0 Hz, so that a reference turns the motor."""
        latest = self.console.latest
        return latest is not None and latest.state.motion == "running" and self._output() == 0

    def _output(self) -> Decimal | None:
        """Return the last known output frequency in Hz, negative in reverse, or None."""
        latest, frequency = self.console.latest, self.session.profile.quantity("output_frequency")
        if latest is None or frequency is None:
            return None
        reading = latest.readings.get(frequency.code)
        if reading is None:
            return None
        number = reading.drawn(
            latest.time,
            current=lambda value: value.number,
            old=lambda value, age: value.number,
            missing=None,
        )
        return number if number is None else with_direction(frequency, number, latest.state)


def _after_esc(way: str) -> str:
    """Prefix a remedy that names a key with Esc: the key works once the run line is closed."""
    return way.replace("Press ", "Press Esc, then ", 1) if way.startswith("Press ") else way


def _alone(event: Key) -> bool:
    """Return True if no other key arrived with this key, or if no terminal sent it."""
    stroke = stroke_of(event)
    return stroke is None or stroke.alone


def _steps(event: Key) -> bool:
    """Return True if an arrow steps the reference: in a burst only the first does."""
    stroke = stroke_of(event)
    return stroke is None or stroke.steps


NOT_SIMULATED = "Inputs are set at the terminals. Only a simulated drive's inputs can be set here."
NOT_REHEARSED = "Only simulated drives can be changed here. Open some with drivepanel demo."
LOOKS_LIKE = "LI1=1,AI1=5V: logic inputs 1 or 0, analog 5V, 12mA, 50%."


REHEARSAL = """\
trip {fault} · power off, on · wire cut, join · mains 180V · load 120%
inertia 3 · jam · key STOP · clear: undo all · state: show all
in 5s: trip {fault} waits for 5 s. No machine moves: it is simulated."""
"""Commands of the bench that a person rehearses with, with a fault of the drive."""


class InputKeys(RunKeys):
    """Actions that change a simulated drive; they are refused on a real line."""

    def action_inputs(self) -> None:
        """Prompt for the inputs of a simulated drive and set them."""
        device = self.session.device
        if (bench := self._bench(NOT_SIMULATED)) is not None and (
            opened := self.app.opened
        ) is not None:
            assert opened.simulation is not None
            about = f"{opened.simulation.drive(device).terminals.reported()}\n{LOOKS_LIKE}"
            question = f"Inputs of the simulated drive {device}"
            self._change(bench, question, about, subject="Simulated inputs", number=True)

    def action_rehearse(self) -> None:
        """Prompt for a trip, a loss of supply or another event of a simulated drive."""
        if (bench := self._bench(NOT_REHEARSED)) is not None:
            question = f"Rehearse on the simulated drive {self.session.device}"
            codes = self.session.profile.data.faults.codes
            about = REHEARSAL.format(fault=codes[0].code if codes else "1")
            self._change(bench, question, about, subject="Simulated drive", number=False)

    def _bench(self, refusal: str) -> Bench | None:
        """Return the bench of a simulated line; None, and a message, on a real one."""
        opened = self.app.opened
        if opened is None or opened.simulation is None:
            self.app.notify(refusal, severity="warning")
            return None
        if opened.bench is None:
            from tui.simulator import Bench

            opened.bench = Bench(opened.simulation)
        return opened.bench

    def _change(
        self, bench: Bench, question: str, about: str, *, subject: str, number: bool
    ) -> None:
        """Ask for a line of the bench, and carry it out on the drive of this screen."""
        from tui.simulator import SimulatorError

        from ..dialogs.ask import Ask

        device = self.session.device

        def fault(text: str) -> str:
            try:
                bench.check(f"{device}: {text}")
            except SimulatorError as error:
                return str(error)
            return ""

        def reported(text: str | None) -> None:
            if text is None:
                return
            results = bench.do(f"{device}: {text}")
            for result in results:
                self.app.notify(f"{subject}, {result.device}: {result.text}")
            if not results:
                self.app.notify(f"{subject}, {device}: waits for its time.")

        self.app.push_screen(
            Ask(question, fault, about=about, takes="Set", number=number), reported
        )
