"""List of lines on Line: named lines, serial ports, recent lines and simulated ones."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text
from textual.events import Resize
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from tui.session.connect.line_key import SIMULATED_PREFIX, is_replay, line_key
from tui.session.connect.named_lines import line_settings
from tui.session.connect.port_settings import port_of
from tui.session.paths import recent_lines
from tui.widgets.drawing import short
from tui.widgets.palette import FAINT
from tui.widgets.plain import entry

from .choices import Group, LineChoice, ListMark, choice_line, groups, same_line


class LineList(OptionList):
    """Lines under headings; redrawn only if lines, marks or width have changed."""

    def update_node_styles(self, animate: bool = True) -> None:
        """Skip styling until the list is attached; Textual then styles it as a whole."""
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
        """Key of the shown line; empty if there is none."""
        self._open: frozenset[str] = frozenset()
        """Keys of all open lines."""
        self._replays: tuple[str, ...] = ()
        """Open replays, which are not among the recent lines."""
        self._faulty: frozenset[str] = frozenset()
        """Keys of the open lines with a drive in fault."""
        self._named = ""
        """Line added by `offer`, even if it is not a recent one; empty if there is none."""

    def look_for_lines(self) -> None:
        """Find the current serial ports and recent lines; reads files. `fill` shows them."""
        from tui.session.connect.open_line import serial_ports

        lately = recent_lines()
        if self._named:
            lately = [self._named, *(text for text in lately if text != self._named)]
        settings = line_settings()
        known = [line.line for line in settings.lines.values()]
        ports = {port for line in known if (port := port_of(line))}
        recent = [
            text
            for text in lately
            if text not in known and (port_of(text) not in ports or self._is_offered(text, known))
        ]
        self._groups = groups(serial_ports(), recent, settings)

    def _is_offered(self, text: str, known: Sequence[str]) -> bool:
        """Return True for the offered line, unless a named line is the same."""
        return text == self._named and not any(same_line(text, line) for line in known)

    def choice(self, id: str | None) -> LineChoice | None:
        """Return the line of an option; None for a heading."""
        return self._choices.get(id or "")

    @property
    def chosen(self) -> LineChoice | None:
        """The line under the cursor; None without a cursor."""
        at = self.highlighted
        return None if at is None else self.choice(self.get_option_at_index(at).id)

    def offer(self, text: str) -> None:
        """List a line and move the cursor to it, so that Enter opens this line."""
        from tui.session.connect.known_lines import remembered_text

        self._named = text = remembered_text(text)
        self.look_for_lines()
        self._fill()
        port = port_of(text)
        fits = [
            id
            for id, choice in self._choices.items()
            if choice.text == text
            or (port and choice.path and port == port_of(choice.path))
            or (port and choice.name and same_line(choice.text, text))
        ]
        if fits:
            self.highlighted = self.get_option_index(fits[0])

    def forget_named(self) -> None:
        """Remove the line that `offer` added."""
        self._named = ""
        self.look_for_lines()
        self._fill()

    def fill(self, shown: str, opened: Sequence[str], faulty: Sequence[str] = ()) -> None:
        """Draw the list, with marks for lines open, shown, in fault; the cursor stays."""
        self._faulty = frozenset(line_key(text) for text in faulty)
        self._here = line_key(shown) if shown else ""
        self._open = frozenset(line_key(text) for text in opened if text)
        self._replays = tuple(dict.fromkeys(text for text in opened if is_replay(text)))
        self._fill()

    def on_resize(self, event: Resize) -> None:
        """Fit the lines to the new width, once the list is visible."""
        if event.size.width and self._shown is not None:
            self._fill()

    def _fill(self) -> None:
        width = max(12, (self.size.width or list_width(self.app.size.width)) - 1)
        if self._shown == (width, self._groups, (self._here, self._open, self._faulty)):
            return
        self._shown = (width, self._groups, (self._here, self._open, self._faulty))
        at = self.highlighted
        chosen = None if at is None else self.get_option_at_index(at).id
        self._choices.clear()
        listed = {choice.text for group in self._groups for choice in group.choices}
        more = tuple(LineChoice(text, "") for text in self._replays if text not in listed)
        shown = [Group("Replays", more), *self._groups] if more else self._groups
        options = [option for group in shown for option in self._rows(group, width)]
        self.clear_options()
        self.add_options(options)
        first = next((at for at, option in enumerate(options) if not option.disabled), None)
        still = chosen is not None and chosen in self._choices
        self.highlighted = self.get_option_index(chosen) if still and chosen else first

    def _rows(self, group: Group, width: int) -> list[Option]:
        """Return the options of a group: its heading, its lines, and its note if that applies."""
        found = [entry(Text(f" {group.title}", FAINT), disabled=True)]
        for choice in group.choices:
            key = f"{group.title} {choice.name} {choice.text}"
            self._choices[key] = choice
            line = line_key(choice.text) if self._may_be_open(choice.text) else ""
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
        """Return True if an open line is of the same kind: simulated, or real.

        Only then compute the key, which imports the simulator for a simulated line.
        """
        if not self._open:
            return False
        simulated = text.casefold().startswith(SIMULATED_PREFIX)
        return any(line.startswith(SIMULATED_PREFIX) is simulated for line in self._open)


def list_width(width: int) -> int:
    """Return the columns of the list before a line is open, on so wide a terminal."""
    return max(22, min(44, width * 44 // 100 - 1))
