"""Form below the list of lines: serial settings, profile and addresses.

The form is drawn as text first and gets its fields later; a test checks that the switch is
invisible.
"""

from __future__ import annotations

from collections.abc import Sequence

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input

from tui.drive.plain import plain
from tui.session.connect.addresses import parse_addresses
from tui.session.connect.port_settings import PortSettings
from tui.widgets.fields import NumberInput, WordField
from tui.widgets.lines import Lines
from tui.widgets.palette import SURFACE, TEXT
from tui.widgets.plain import Plain

from .choices import LineChoice

FIELD_NAME_CELLS = 11
FORMAT_CELLS = 4

FIELD_NAME = Style(color="#85898d")
FIELD_TEXT = Style(color=TEXT, bgcolor=SURFACE)
EMPTY = Style(color="#7a7d7f", bgcolor=SURFACE)
OFF = Style(color="#969a9e", bgcolor="#24272b")
"""Colors that Textual mixes for a name, a value, a placeholder and a disabled field."""


def form_lines(rows: Sequence[tuple[str, Sequence[Text]]], width: int) -> list[Text]:
    """Draw names with their fields; in a row, fields after the first have `FORMAT_CELLS` cells."""
    lines = []
    for name, fields in rows:
        line = Text(f" {name:<{FIELD_NAME_CELLS - 1}}", FIELD_NAME, no_wrap=True)
        short = [FORMAT_CELLS] * (len(fields) - 1)
        first = max(0, width - FIELD_NAME_CELLS - sum(short) - len(short))
        for cells, field in zip([first, *short], fields, strict=True):
            line.append(" " if line.cell_len > FIELD_NAME_CELLS else "")
            shown = field.copy()
            shown.truncate(cells, pad=True)
            line.append_text(shown)
        lines.append(line)
    return lines


def drawn_field(value: str, instead: str = "", *, off: bool = False) -> Text:
    """Draw the value of a field, or the placeholder `instead` if it is empty."""
    if not value:
        return Text(plain(instead), EMPTY)
    return Text(plain(value), OFF if off else FIELD_TEXT)


BAUD, FORMAT, ADDRESSES = "19200", "8E1", "1-10"
FIELD_ROWS = (
    ("Serial", ("baud", "format")),
    ("Profile", ("profile",)),
    ("Addresses", ("addresses",)),
)
"""Name of each row, and the ids of its fields."""


class LineForm(Vertical):
    """Three rows of fields; an empty serial setting means the default.

    The fields are only drawn until `put_fields`, but their values apply from the start.
    """

    typed = False
    """True if the user has edited the addresses since the last line was opened."""
    _offered: tuple[str, PortSettings | None] | None = None
    """Port whose settings were shown last, with these."""
    _there = False
    """True once the fields are mounted."""

    def __init__(self) -> None:
        super().__init__()
        self._fields = {
            "baud": NumberInput(BAUD, id="baud", type="integer", max_length=6),
            "format": NumberInput(FORMAT, id="format", max_length=3),
            "profile": WordField("", id="profile", placeholder="identify"),
            "addresses": NumberInput(ADDRESSES, id="addresses"),
        }
        self._picture: Lines | None = Lines(fit=self._drawn)
        self._requested: Input | None = None
        """Field to focus once it is mounted."""

    def compose(self) -> ComposeResult:
        """Yield the drawn form; `put_fields` mounts the fields."""
        if self._picture is not None:
            yield self._picture

    def _draw(self) -> None:
        """Redraw the current values; does nothing once `put_fields` has run."""
        if self._picture is not None and (width := self.size.width):
            self._picture.show(self._drawn(width))

    def _drawn(self, width: int) -> list[Text]:
        """Draw the form at this width."""
        return form_lines(
            [(name, [self._drawn_field(field) for field in fields]) for name, fields in FIELD_ROWS],
            width,
        )

    def _drawn_field(self, name: str) -> Text:
        field = self._fields[name]
        return drawn_field(field.value, field.placeholder, off=field.disabled)

    async def put_fields(self) -> None:
        """Replace the drawn form with its fields; does nothing the second time."""
        picture, self._picture = self._picture, None
        if picture is None:
            return
        rows = (
            Horizontal(Plain(name), *(self._fields[field] for field in fields), classes="settings")
            for name, fields in FIELD_ROWS
        )
        with self.app.batch_update():
            await self.mount(*rows)
            await picture.remove()
        self._there = True
        if self._requested is not None:
            self.screen.set_focus(self._requested)

    def line_at(self, path: str, timeout: float | None = None) -> str:
        """Return the LINE of a serial port with the settings in the form.

        `timeout` is the longest wait for a reply in seconds; None for the default.
        """
        baud, format = self._typed("baud") or BAUD, self._typed("format").upper() or FORMAT
        longest = "" if timeout is None else f",timeout={timeout:g}"
        return f"serial:{path},{baud},{format}{longest}"

    @property
    def addresses_text(self) -> str:
        """Addresses as typed, not checked."""
        return self._typed("addresses")

    def addresses(self) -> list[int]:
        """Parse the addresses to scan. Raises LinkSyntaxError if they are invalid."""
        return parse_addresses(self._fields["addresses"].value)

    def offer_addresses(self, text: str) -> None:
        """Show the addresses of an opened line, unless the user has just edited them."""
        if not self.typed:
            field = self._fields["addresses"]
            with field.prevent(Input.Changed):
                field.value = text
            self._draw()
        self.typed = False

    def on_input_changed(self, event: Input.Changed) -> None:
        """Note that the user has edited the addresses."""
        if event.input.id == "addresses" and event.input.has_focus:
            self.typed = True

    def ask_for_addresses(self) -> None:
        """Focus the addresses field at once, or as soon as it is mounted."""
        self._enter("addresses")

    @property
    def profile(self) -> str:
        """The typed profile in lower case; empty if there is none."""
        return self._typed("profile").lower()

    def ask_for_profile(self) -> None:
        """Focus the profile field at once, or as soon as it is mounted."""
        self._enter("profile")

    def _enter(self, name: str) -> None:
        self._requested = self._fields[name]
        if self._there:
            self.screen.set_focus(self._requested)

    def offer_settings(self, choice: LineChoice | None) -> None:
        """Enable baud and format for a serial port, and show those with which it was used last.

        They are disabled for other lines. What was typed for a port stays while it is chosen.
        """
        port = (choice.path, choice.settings) if choice is not None and choice.path else None
        for name in ("baud", "format"):
            self._fields[name].disabled = port is None
        if port is not None and port != self._offered:
            self._offered = port
            used = port[1]
            self.show_settings(used.baud if used else int(BAUD), used.format if used else FORMAT)
        self._draw()

    def show_settings(self, baud: int, format: str) -> None:
        """Show the settings at which drives answered."""
        for name, value in (("baud", str(baud)), ("format", format)):
            field = self._fields[name]
            with field.prevent(Input.Changed):
                field.value = value
        self._draw()

    def _typed(self, name: str) -> str:
        return self._fields[name].value.strip()
