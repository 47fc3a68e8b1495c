"""Keys that learn the scale of a raw value from the drive's own display."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import OptionList

from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile
from tui.drive.shown import shown
from tui.drive.taught_profile import teachable_codes, why_not_taught
from tui.drive.teaching import parse_display
from tui.session.teaching.teacher import Teacher, reference_asks
from tui.session.work import OutcomeKind
from tui.widgets.drawing import fitted_names
from tui.widgets.palette import FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry

from ..dialogs.question import KeyQuestion, hint
from .arming import ArmingKeys

if TYPE_CHECKING:
    from tui.session.console import DriveConsole

    from ..dialogs.now import MotorStates

HOW = "Type it with its unit: 50.3Hz, 8.4A, 1450rpm. Enter reads the raw value at that moment."
WIDEST_LIST, AROUND_LIST = 70, 6
"""Cells of the dialog at most, and those around a line of its list."""
BESIDE_WORD = 30
"""Cells of a line without the name."""


class TeachKeys(ArmingKeys):
    """Asks what the drive's display shows; nothing is written to the drive."""

    @property
    def teacher(self) -> Teacher:
        """Learned scales of this drive."""
        return self.console.teacher

    def ask_look(self, code: str) -> None:
        """Ask what the drive's display shows for a parameter, and learn from it."""
        from ..dialogs.ask import Ask

        if why := why_not_taught(self.session.family, code):
            self._refuse(why)
            return
        name = self.session.family[code].name
        requested = Ask(
            f"What does the drive's display show for {code}, {name}?",
            fault_of_look,
            about=f"{_known(self.console, code)} {HOW}",
            takes="Read and learn",
            number=True,
            now=self.motor_state_text(),
        )

        def reported(text: str | None) -> None:
            if text:
                self.run_worker(self._look_at(code, text), group="teach")

        self.app.push_screen(requested, reported)

    async def _look_at(self, code: str, text: str) -> None:
        work, teacher = self.session.work, self.teacher
        try:
            lesson = await teacher.look(code, text)
        except (DriveError, LineError) as error:
            work.report(OutcomeKind.REFUSED, str(error))
        else:
            work.report(OutcomeKind.REFUSED if lesson.went_wrong else OutcomeKind.DONE, lesson.text)
            if teacher.trouble:
                self.app.notify(teacher.trouble, severity="warning")
            if teacher.proposal() == code and self.is_current:
                self.ask_reference(code, by_itself=True)
        self.look()

    def ask_reference(self, code: str, *, by_itself: bool = False) -> None:
        """Ask to set the reference through a parameter with a learned scale."""

        def confirm(_stamp: int) -> None:
            self.run_worker(self._settle(lambda: self.teacher.confirm_reference(code)))

        follows = reference_asks(self.session.family, code)
        question = f"Set the reference through {code}?"
        self._ask(question, follows, "Use", "Cancel", confirm, by_itself=by_itself)

    def ask_no_reference(self, code: str) -> None:
        """Ask to stop setting the reference through a parameter."""

        def drop() -> str:
            self.teacher.drop_reference()
            return f"{code} no longer sets the reference."

        def confirmed(_stamp: int) -> None:
            self.run_worker(self._settle(drop))

        follows = "Run commands no longer select it. The drive keeps its present values."
        self._ask(
            f"Stop setting the reference through {code}?", follows, "End", "Cancel", confirmed
        )

    async def _settle(self, change: Callable[[], str]) -> None:
        """Make a change that is stored on disk, and report its result."""
        work = self.session.work
        try:
            work.report(OutcomeKind.DONE, await asyncio.to_thread(change))
        except DriveError as error:
            work.report(OutcomeKind.REFUSED, str(error))
        if self.teacher.trouble:
            self.app.notify(self.teacher.trouble, severity="warning")
        self.look()


class PickWord(KeyQuestion[str | None]):
    """A list of values that are shown raw, or have a learned scale; answers with a code."""

    BINDINGS: ClassVar = []

    def __init__(self, console: DriveConsole, codes: Sequence[str], now: MotorStates) -> None:
        super().__init__(now)
        self._drive_console, self._codes = console, codes

    def dialog(self) -> ComposeResult:
        """The list and its keys."""
        with Vertical(id="dialog"):
            yield Plain("Learn the scale of which value?", id="question")
            yield from self.now_lines()
            width = min(WIDEST_LIST, self.app.size.width) - AROUND_LIST
            texts = teach_lines(self._drive_console, self._codes, width)
            lines = (entry(text, id=code_id(at)) for at, text in enumerate(texts))
            yield OptionList(*lines, id="choices", compact=True)
            keys = (("Up, Down", "Choose"), ("Enter", "Continue"), ("Esc or q", "Cancel"))
            yield Plain("For other values, press L on Parameters (3).", id="about")
            yield Plain(hint(*keys), id="hint")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer with the code under the cursor."""
        self.answer(self._codes[event.option_index])


def code_id(place: int) -> str:
    """Return the id of a list entry; a code may contain characters that Textual rejects."""
    return f"word{place}"


def teach_lines(console: DriveConsole, codes: Sequence[str], width: int) -> list[Text]:
    """Return a line for each parameter: code, name and present value."""
    profile = console.session.profile
    room = width - BESIDE_WORD
    names = fitted_names(tuple(profile[code].name for code in codes), room)
    return [_teach_line(console, code, f"{names[profile[code].name]:<{room}}") for code in codes]


def _teach_line(console: DriveConsole, code: str, name: str) -> Text:
    session = console.session
    text = Text(f" {code:<8}", PLAIN, no_wrap=True)
    text.append(f"{name} ", PLAIN)
    raw = session.image.raws.get(code)
    if raw is None:
        return text.append("not read yet", FAINT)
    value = shown(session.profile, session.profile[code], raw, session.image.raws)
    text.append(f"{value.display if value.taught else f'raw {raw}':>12}", STRONG)
    return text.append("  learned" if value.taught else "", FAINT)


def words_to_teach(profile: Profile, watched: Sequence[str]) -> list[str]:
    """Codes that Monitor offers: those it shows, then those that can set the reference."""
    can = {*teachable_codes(profile), *profile.taught}
    ways = profile.data.teachable_references
    offered = [*watched, *(code for way in ways for code in (way.parameter, way.most))]
    return [code for code in dict.fromkeys((*offered, *profile.taught)) if code in can]


def fault_of_look(text: str) -> str:
    """Return the error in a typed reading; empty if it is valid."""
    try:
        parse_display(text)
    except DriveError as error:
        return str(error)
    return ""


def _known(console: DriveConsole, code: str) -> str:
    """Return the raw value, and what has been learned so far."""
    raw = console.session.image.raws.get(code)
    now = "" if raw is None else f"Present raw value: {raw}. "
    scale = console.teacher.scales.get(code)
    looks = console.teacher.looks(code)
    if scale is not None:
        return f"{now}Learned scale: {scale.text}. A reading that disagrees discards it."
    if looks:
        seen = ", ".join(look.text for look in looks)
        return f"{now}Earlier readings: {seen}. Read at another value."
    return f"{now}Two readings at different values give the scale."
