"""Keys that teach a raw value by the drive's own display, on every screen that shows one."""

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
from tui.session.work import OutcomeKind
from tui.widgets.drawing import fitted_names
from tui.widgets.palette import FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry

from ..dialogs.question import KeyQuestion, hint
from .arming import ArmingKeys

if TYPE_CHECKING:
    from tui.session.console import DriveConsole
    from tui.session.teaching.teacher import Teacher

    from ..dialogs.now import MotorStates

HOW = "Type it with its unit: 50.3Hz, 8.4A, 1450rpm. The word is read when Enter is pressed."
WIDEST_LIST, AROUND_LIST = 70, 6
"""Cells of the dialog at most, and those around a line of its list."""
BESIDE_WORD = 30
"""Cells of a line without the name."""


class TeachKeys(ArmingKeys):
    """Asks what the display shows; nothing is written to the drive."""

    @property
    def teacher(self) -> Teacher:
        """Taught scales of this drive."""
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
        """Ask whether a taught parameter shall take the reference from now on."""
        from tui.session.teaching.teacher import reference_asks

        def confirm(_stamp: int) -> None:
            self.run_worker(self._settle(lambda: self.teacher.confirm_reference(code)))

        follows = reference_asks(self.session.family, code)
        question = f"Give the reference by {code}?"
        self._ask(question, follows, "Use", "Cancel", confirm, by_itself=by_itself)

    def ask_no_reference(self, code: str) -> None:
        """Ask whether a taught parameter shall take the reference no longer."""

        def drop() -> str:
            self.teacher.drop_reference()
            return f"{code} takes the reference no longer."

        def confirmed(_stamp: int) -> None:
            self.run_worker(self._settle(drop))

        follows = "Commands to run no longer choose it. The drive keeps what it holds."
        self._ask(f"No reference by {code} any more?", follows, "End", "Cancel", confirmed)

    async def _settle(self, change: Callable[[], str]) -> None:
        """Make a change that waits for the disk, and report its result."""
        work = self.session.work
        try:
            work.report(OutcomeKind.DONE, await asyncio.to_thread(change))
        except DriveError as error:
            work.report(OutcomeKind.REFUSED, str(error))
        if self.teacher.trouble:
            self.app.notify(self.teacher.trouble, severity="warning")
        self.look()


class PickWord(KeyQuestion[str | None]):
    """A list of words that are shown raw, or were taught; gives the code of one back."""

    BINDINGS: ClassVar = []

    def __init__(self, console: DriveConsole, codes: Sequence[str], now: MotorStates) -> None:
        super().__init__(now)
        self._drive_console, self._codes = console, codes

    def dialog(self) -> ComposeResult:
        """The list and its keys."""
        with Vertical(id="dialog"):
            yield Plain("Which value shall be taught?", id="question")
            yield from self.now_lines()
            width = min(WIDEST_LIST, self.app.size.width) - AROUND_LIST
            texts = teach_lines(self._drive_console, self._codes, width)
            lines = (entry(text, id=code_id(at)) for at, text in enumerate(texts))
            yield OptionList(*lines, id="choices", compact=True)
            keys = (("Up, Down", "choose"), ("Enter", "continue"), ("Esc or q", "no"))
            yield Plain("Others: Parameters (3), L.", id="about")
            yield Plain(hint(*keys), id="hint")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Take the one under the cursor."""
        self.answer(self._codes[event.option_index])


def code_id(place: int) -> str:
    """Return the id of a line of the list; a code may have characters that Textual rejects."""
    return f"word{place}"


def teach_lines(console: DriveConsole, codes: Sequence[str], width: int) -> list[Text]:
    """Return a line for each word: code, name, and the value that it holds now."""
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
    return text.append("  taught" if value.taught else "", FAINT)


def words_to_teach(profile: Profile, watched: Sequence[str]) -> list[str]:
    """Codes that Monitor offers: those it watches, then what may take the reference."""
    can = {*teachable_codes(profile), *profile.taught}
    ways = profile.data.teachable_references
    offered = [*watched, *(code for way in ways for code in (way.parameter, way.most))]
    return [code for code in dict.fromkeys((*offered, *profile.taught)) if code in can]


def fault_of_look(text: str) -> str:
    """Return the error in a typed reading, or nothing."""
    try:
        parse_display(text)
    except DriveError as error:
        return str(error)
    return ""


def _known(console: DriveConsole, code: str) -> str:
    """Return what is known so far."""
    raw = console.session.image.raws.get(code)
    now = "" if raw is None else f"It reads raw {raw} now. "
    scale = console.teacher.scales.get(code)
    looks = console.teacher.looks(code)
    if scale is not None:
        return f"{now}Taught: {scale.text}. A look that disagrees ends it."
    if looks:
        seen = ", ".join(look.text for look in looks)
        return f"{now}Seen before: {seen}. Look at another value."
    return f"{now}Two readings at different values show what a count is."
