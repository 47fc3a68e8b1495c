"""The fields below the lines: addresses to ask, settings of a serial port, the profile.

Pure; a test holds that nothing is seen of the change.
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
from tui.widgets.fields import NumberInput, WordField
from tui.widgets.lines import Lines
from tui.widgets.palette import SURFACE, TEXT
from tui.widgets.plain import Plain

FIELD_NAME_CELLS = 11
FORMAT_CELLS = 4

FIELD_NAME = Style(color="#85898d")
FIELD_TEXT = Style(color=TEXT, bgcolor=SURFACE)
EMPTY = Style(color="#7a7d7f", bgcolor=SURFACE)
OFF = Style(color="#969a9e", bgcolor="#24272b")
"""The colors that Textual mixes for a name, a field, the text in an empty one, one that is off."""


def form_lines(rows: Sequence[tuple[str, Sequence[Text]]], width: int) -> list[Text]:
    """Names with their fields; the last of several fields in a row is a short one."""
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
    """Return the contents of a field, or the hint in an empty one."""
    if not value:
        return Text(plain(instead), EMPTY)
    return Text(plain(value), OFF if off else FIELD_TEXT)


BAUD, FORMAT, ADDRESSES = "19200", "8E1", "1-10"
FIELD_ROWS = (
    ("Serial", ("baud", "format")),
    ("Profile", ("profile",)),
    ("Addresses", ("addresses",)),
)
"""Names of the rows with the fields in each."""


class LineForm(Vertical):
    """Three rows of fields; an empty setting counts as the usual one.

    Until `put_fields` they are a picture, though their values count from the start.
    """

    typed = False
    """True if a person has typed addresses since the last line was opened."""
    _there = False
    """True if there are fields to type into."""

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
        """The field that was asked for before it was there."""

    def compose(self) -> ComposeResult:
        """The picture of the fields."""
        if self._picture is not None:
            yield self._picture

    def _draw(self) -> None:
        """Show the values as they are now, while there is a picture only."""
        if self._picture is not None and (width := self.size.width):
            self._picture.show(self._drawn(width))

    def _drawn(self, width: int) -> list[Text]:
        """The fields as they will look."""
        return form_lines(
            [(name, [self._drawn_field(field) for field in fields]) for name, fields in FIELD_ROWS],
            width,
        )

    def _drawn_field(self, name: str) -> Text:
        field = self._fields[name]
        return drawn_field(field.value, field.placeholder, off=field.disabled)

    async def put_fields(self) -> None:
        """Put the fields in the place of their picture; they are not seen below another screen."""
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

    def line_at(self, path: str) -> str:
        """The LINE of a serial port with these settings."""
        return (
            f"serial:{path},{self._typed('baud') or BAUD},{self._typed('format').upper() or FORMAT}"
        )

    @property
    def addresses_text(self) -> str:
        """The addresses as typed in the field."""
        return self._typed("addresses")

    def addresses(self) -> list[int]:
        """The addresses to ask; raises LinkSyntaxError where they are none."""
        return parse_addresses(self._fields["addresses"].value)

    def offer_addresses(self, text: str) -> None:
        """The addresses of a line that was opened, unless a person has just typed others."""
        if not self.typed:
            field = self._fields["addresses"]
            with field.prevent(Input.Changed):
                field.value = text
            self._draw()
        self.typed = False

    def on_input_changed(self, event: Input.Changed) -> None:
        """Note that a person has typed addresses."""
        if event.input.id == "addresses" and event.input.has_focus:
            self.typed = True

    def ask_for_addresses(self) -> None:
        """Into the field of the addresses, at once: what is typed next belongs there."""
        self._enter("addresses")

    @property
    def profile(self) -> str:
        """The profile that was typed, or nothing."""
        return self._typed("profile").lower()

    def ask_for_profile(self) -> None:
        """Into the field of the profile, at once: what is typed next belongs there."""
        self._enter("profile")

    def _enter(self, name: str) -> None:
        self._requested = self._fields[name]
        if self._there:
            self.screen.set_focus(self._requested)

    def offer_settings(self, port: bool) -> None:
        """Only a serial port has settings that are chosen here."""
        for name in ("baud", "format"):
            self._fields[name].disabled = not port
        self._draw()

    def show_settings(self, baud: int, format: str) -> None:
        """The settings at which drives answered are in their fields."""
        for name, value in (("baud", str(baud)), ("format", format)):
            field = self._fields[name]
            with field.prevent(Input.Changed):
                field.value = value
        self._draw()

    def _typed(self, name: str) -> str:
        return self._fields[name].value.strip()
