"""Options of a drive's commands: ramps, preset speeds, motors, outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import OptionList

from tui.drive.profile.schema import CommandOption
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry

from ..dialogs.question import KeyQuestion, hint

if TYPE_CHECKING:
    from ..dialogs.now import MotorStates

OPTION_HINT = hint(("Up, Down", "choose"), ("y", "write"), ("Esc or q", "cancel"))


class OptionsScreen(KeyQuestion[tuple[CommandOption, int] | None]):
    """A list of every choice; gives the one under the cursor back for `y`, or None."""

    BINDINGS: ClassVar = [Binding("y", "yes", show=False), Binding("o", "no", show=False)]

    def __init__(
        self,
        options: Sequence[CommandOption],
        raws: Mapping[str, int],
        now: MotorStates | None = None,
    ) -> None:
        super().__init__(now)
        self._choices = [
            (option, choice.bits, option_line(option, choice.bits, choice.name, raws))
            for option in options
            for choice in option.choices
        ]

    def dialog(self) -> ComposeResult:
        """The list and its keys."""
        with Vertical(id="dialog"):
            yield Plain("Command options", id="question")
            yield from self.now_lines()
            yield OptionList(
                *(entry(line, id=str(at)) for at, (_, _, line) in enumerate(self._choices)),
                id="choices",
                compact=True,
            )
            yield Plain(OPTION_HINT, id="hint")

    def on_option_list_option_selected(self) -> None:
        """Enter writes nothing: say which key does."""
        reported = Text("Press y or Esc.   ", ALARM)
        self.tell_keys(reported.append_text(OPTION_HINT))

    def action_yes(self) -> None:
        """Give the choice back."""
        at = self.query_one(OptionList).highlighted
        if at is not None:
            option, bits, _ = self._choices[at]
            self.answer((option, bits))


def option_line(option: CommandOption, bits: int, name: str, raws: Mapping[str, int]) -> Text:
    """One choice, with a mark where the drive holds it now."""
    raw = raws.get(option.parameter)
    held = raw is not None and raw & option.mask == bits
    text = Text(no_wrap=True)
    text.append(" ● " if held else " · ", STRONG if held else FAINT)
    text.append(f"{option.name:<18}", FAINT)
    text.append(f"{name:<16}", STRONG if held else PLAIN)
    text.append(f"{option.parameter}{'  stopped only' if option.stopped_only else ''}", FAINT)
    return text
