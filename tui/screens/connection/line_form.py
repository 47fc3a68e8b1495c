"""The fields beside the lines: settings of a serial port, addresses to ask, the profile."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input

from tui.session.connect.addresses import parse_addresses
from tui.widgets.fields import NumberInput
from tui.widgets.plain import Plain

BAUD, FORMAT = "19200", "8E1"


class LineForm(Vertical):
    """Two rows of two fields; an empty setting counts as the usual one."""

    def compose(self) -> ComposeResult:
        """The fields with their names."""
        with Horizontal(classes="settings"):
            yield Plain("Baud")
            yield NumberInput(BAUD, id="baud", type="integer", max_length=6)
            yield Plain("Format")
            yield NumberInput(FORMAT, id="format", max_length=3)
        with Horizontal(classes="settings"):
            yield Plain("Ask")
            yield NumberInput("1-10", id="addresses")
            yield Plain("Profile")
            yield NumberInput("", id="profile", placeholder="identify")

    def line_at(self, path: str) -> str:
        """The LINE of a serial port with these settings."""
        return (
            f"serial:{path},{self._typed('baud') or BAUD},{self._typed('format').upper() or FORMAT}"
        )

    def addresses(self) -> list[int]:
        """The addresses to ask; raises LinkSyntaxError where they are none."""
        return parse_addresses(self._field("addresses").value)

    @property
    def profile(self) -> str:
        """The profile that was typed, or nothing."""
        return self._typed("profile").lower()

    def ask_for_profile(self) -> None:
        """Into the field of the profile."""
        self._field("profile").focus()

    def offer_settings(self, port: bool) -> None:
        """Only a serial port has settings that are chosen here."""
        for name in ("baud", "format"):
            self._field(name).disabled = not port

    def _field(self, name: str) -> Input:
        return self.query_one(f"#{name}", Input)

    def _typed(self, name: str) -> str:
        return self._field(name).value.strip()
