"""Options of a drive's commands: ramps, preset speeds, motors, outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import OptionList

from tui.drive.schema import CommandOption
from tui.widgets.palette import FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry


class OptionsScreen(ModalScreen[tuple[CommandOption, int] | None]):
    """A list of every choice; gives the chosen one back, or None."""

    CSS_PATH = "ask.tcss"
    BINDINGS: ClassVar = [Binding("escape,o", "dismiss(None)", "cancel", show=False)]

    def __init__(self, options: Sequence[CommandOption], raws: Mapping[str, int]) -> None:
        super().__init__()
        self._choices = [
            (option, choice.bits, choice_line(option, choice.bits, choice.name, raws))
            for option in options
            for choice in option.choices
        ]

    def compose(self) -> ComposeResult:
        """The list and its keys."""
        with Vertical(id="dialog"):
            yield Plain("Options of the commands", id="question")
            yield OptionList(
                *(entry(line, id=str(at)) for at, (_, _, line) in enumerate(self._choices)),
                id="choices",
                compact=True,
            )
            yield Plain("Enter sets it   Esc cancel", id="hint")

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Give the choice back."""
        option, bits, _ = self._choices[int(event.option.id or 0)]
        self.dismiss((option, bits))


def choice_line(option: CommandOption, bits: int, name: str, raws: Mapping[str, int]) -> Text:
    """One choice, with a mark where the drive holds it now."""
    raw = raws.get(option.parameter)
    held = raw is not None and raw & option.mask == bits
    text = Text(no_wrap=True)
    text.append(" ● " if held else " · ", STRONG if held else FAINT)
    text.append(f"{option.name:<18}", FAINT)
    text.append(f"{name:<16}", STRONG if held else PLAIN)
    text.append(f"{option.parameter}{'  stopped only' if option.stopped_only else ''}", FAINT)
    return text
