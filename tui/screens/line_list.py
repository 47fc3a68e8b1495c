"""The list of lines on the Connection screen: serial ports, those used lately, simulated ones."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from tui.session.state import recent_lines
from tui.widgets.palette import FAINT

from .choices import Group, LineChoice, choice_line, groups


class LineList(OptionList):
    """Lines under headings; drawn anew only when they or its width have changed."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)
        self._groups: list[Group] = []
        self._choices: dict[str, LineChoice] = {}
        self._shown: tuple[int, list[Group]] | None = None

    def look_for_lines(self) -> None:
        """Find the serial ports there are now, and the lines used lately."""
        from tui.session.lines import serial_ports

        self._groups = groups(serial_ports(), recent_lines())

    def choice(self, id: str | None) -> LineChoice | None:
        """The line of an option; None for a heading."""
        return self._choices.get(id or "")

    def fill(self) -> None:
        """Show what was found; the cursor stays at its place."""
        width = max(20, self.size.width - 1)
        if self._shown == (width, self._groups):
            return
        self._shown = (width, self._groups)
        chosen = self.highlighted
        self._choices.clear()
        options = [option for group in self._groups for option in self._rows(group, width)]
        self.clear_options()
        self.add_options(options)
        first = next((at for at, option in enumerate(options) if not option.disabled), None)
        self.highlighted = chosen if chosen is not None else first

    def _rows(self, group: Group, width: int) -> list[Option]:
        """A heading with its lines, or with what is said of none."""
        found = [Option(Text(group.title, FAINT), disabled=True)]
        for choice in group.choices:
            key = f"{group.title} {choice.text}"
            self._choices[key] = choice
            found.append(Option(choice_line(choice, width), id=key))
        if not group.choices:
            found.append(Option(Text(f"  {group.empty}", FAINT), disabled=True))
        return found
