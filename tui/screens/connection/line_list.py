"""The list of lines on Line: serial ports, those used lately, simulated ones."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from tui.session.connect.named_lines import line_settings
from tui.session.paths import recent_lines
from tui.widgets.drawing import short
from tui.widgets.palette import FAINT
from tui.widgets.plain import entry

from .choices import Group, LineChoice, ListMark, choice_line, groups


class LineList(OptionList):
    """Lines under headings; drawn again only when they or its width have changed."""

    def update_node_styles(self, animate: bool = True) -> None:
        """Nothing is styled before it is on a screen: then it is, as a whole."""
        if self.is_attached:
            super().update_node_styles(animate)

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)
        self._groups: list[Group] = []
        self._choices: dict[str, LineChoice] = {}
        self._shown: tuple[int, list[Group], tuple[str, frozenset[str], frozenset[str]]] | None = (
            None
        )
        self._here = ""
        """The key of the line that is shown."""
        self._open: frozenset[str] = frozenset()
        """Those of all lines that are open."""
        self._faulty: frozenset[str] = frozenset()
        """Those of the open lines with a drive in fault."""
        self._named = ""
        """A line that somebody has named: it may be none of those used lately."""

    def look_for_lines(self) -> None:
        """Find the serial ports there are now, and the lines used lately."""
        from tui.session.connect.open_line import serial_ports

        lately = recent_lines()
        named = [self._named] if self._named and self._named not in lately else []
        settings = line_settings()
        known = {line.line for line in settings.lines.values()}
        recent = [text for text in [*named, *lately] if text not in known]
        self._groups = groups(serial_ports(), recent, settings)

    def choice(self, id: str | None) -> LineChoice | None:
        """The line of an option; None for a heading."""
        return self._choices.get(id or "")

    @property
    def chosen(self) -> LineChoice | None:
        """The line under the cursor."""
        at = self.highlighted
        return None if at is None else self.choice(self.get_option_at_index(at).id)

    def offer(self, text: str) -> None:
        """Put the cursor on a line that was named, so that Enter means no other."""
        from tui.session.connect.known_lines import remembered_text

        self._named = text = remembered_text(text)
        self.look_for_lines()
        self._fill()
        fits = [id for id, choice in self._choices.items() if choice.text == text]
        if fits:
            self.highlighted = self.get_option_index(fits[0])

    def forget_named(self) -> None:
        """Show that no line was named."""
        self._named = ""
        self.look_for_lines()
        self._fill()

    def fill(self, shown: str, opened: Sequence[str], faulty: Sequence[str] = ()) -> None:
        """Show what was found; which lines are open, shown, in fault. The cursor stays."""
        self._faulty = frozenset(_key(text) for text in faulty)
        self._here = _key(shown) if shown else ""
        self._open = frozenset(_key(text) for text in opened if text)
        self._fill()

    def _fill(self) -> None:
        width = max(12, (self.size.width or list_width(self.app.size.width)) - 1)
        if self._shown == (width, self._groups, (self._here, self._open, self._faulty)):
            return
        self._shown = (width, self._groups, (self._here, self._open, self._faulty))
        at = self.highlighted
        chosen = None if at is None else self.get_option_at_index(at).id
        self._choices.clear()
        options = [option for group in self._groups for option in self._rows(group, width)]
        self.clear_options()
        self.add_options(options)
        first = next((at for at, option in enumerate(options) if not option.disabled), None)
        still = chosen is not None and chosen in self._choices
        self.highlighted = self.get_option_index(chosen) if still and chosen else first

    def _rows(self, group: Group, width: int) -> list[Option]:
        """A heading with its lines, or with what is said of none."""
        found = [entry(Text(f" {group.title}", FAINT), disabled=True)]
        for choice in group.choices:
            key = f"{group.title} {choice.name} {choice.text}"
            self._choices[key] = choice
            line = _key(choice.text) if self._may_be_open(choice.text) else ""
            found.append(entry(choice_line(choice, width, self._mark(line)), id=key))
        if group.empty and (not group.choices or group.title == "Named"):
            found.append(entry(Text(short(f"  {group.empty}", width), FAINT), disabled=True))
        return found

    def _mark(self, line: str) -> ListMark:
        if line not in self._open:
            return ""
        if line == self._here:
            return "shown"
        return "fault" if line in self._faulty else "open"

    def _may_be_open(self, text: str) -> bool:
        """Return True if a line has to be looked at closer; to know simulated ones takes the
        simulator."""
        if not self._open:
            return False
        from tui.session.connect.line_key import SIMULATED_PREFIX

        simulated = text.casefold().startswith(SIMULATED_PREFIX)
        return any(line.startswith(SIMULATED_PREFIX) is simulated for line in self._open)


def list_width(width: int) -> int:
    """The width that the styles give the list on a terminal of so many columns."""
    return max(22, min(32, width * 32 // 100))


def _key(text: str) -> str:
    """Which line is meant; asked while one is open only: what a line is made of is there then."""
    from tui.session.connect.line_key import line_key

    return line_key(text)
