"""The fields below the lines: addresses to ask, settings of a serial port, the profile."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input

from tui.session.connect.addresses import parse_addresses
from tui.widgets.fields import NumberInput
from tui.widgets.plain import Plain

BAUD, FORMAT, ADDRESSES = "19200", "8E1", "1-10"


class LineForm(Vertical):
    """Three rows of fields; an empty setting counts as the usual one."""

    typed = False
    """Whether a person has typed addresses since the last line was opened."""

    def compose(self) -> ComposeResult:
        """The fields with their names."""
        with Horizontal(classes="settings"):
            yield Plain("Serial")
            yield NumberInput(BAUD, id="baud", type="integer", max_length=6)
            yield NumberInput(FORMAT, id="format", max_length=3)
        with Horizontal(classes="settings"):
            yield Plain("Profile")
            yield NumberInput("", id="profile", placeholder="identify")
        with Horizontal(classes="settings"):
            yield Plain("Addresses")
            yield NumberInput(ADDRESSES, id="addresses")

    def line_at(self, path: str) -> str:
        """The LINE of a serial port with these settings."""
        return (
            f"serial:{path},{self._typed('baud') or BAUD},{self._typed('format').upper() or FORMAT}"
        )

    @property
    def addresses_text(self) -> str:
        """The addresses as they stand in the field."""
        return self._typed("addresses")

    def addresses(self) -> list[int]:
        """The addresses to ask; raises LinkSyntaxError where they are none."""
        return parse_addresses(self._field("addresses").value)

    def offer_addresses(self, text: str) -> None:
        """The addresses of a line that was opened, unless a person has just typed others."""
        if not self.typed:
            field = self._field("addresses")
            with field.prevent(Input.Changed):
                field.value = text
        self.typed = False

    def on_input_changed(self, event: Input.Changed) -> None:
        """Note that a person has typed addresses."""
        if event.input.id == "addresses" and event.input.has_focus:
            self.typed = True

    def ask_for_addresses(self) -> None:
        """Into the field of the addresses, at once: what is typed next belongs there."""
        self.screen.set_focus(self._field("addresses"))

    @property
    def profile(self) -> str:
        """The profile that was typed, or nothing."""
        return self._typed("profile").lower()

    def ask_for_profile(self) -> None:
        """Into the field of the profile, at once: what is typed next belongs there."""
        self.screen.set_focus(self._field("profile"))

    def offer_settings(self, port: bool) -> None:
        """Only a serial port has settings that are chosen here."""
        for name in ("baud", "format"):
            self._field(name).disabled = not port

    def _field(self, name: str) -> Input:
        return self.query_one(f"#{name}", Input)

    def _typed(self, name: str) -> str:
        return self._field(name).value.strip()
