"""Field for the address of a drive, which becomes the open one."""

from __future__ import annotations

from collections.abc import Mapping

from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input

from tui.widgets.fields import NumberInput
from tui.widgets.plain import Plain

from .question import Question, hint

NO_DRIVE_AT = "No drive {address} on this line."
NOT_IDENTIFIED = "Drive {address} is not identified."


class AddressField(Question[int | None]):
    """Two rows below the tabs; answers with the address of a drive, or None.

    Only Enter opens the drive: until then the stop key keeps its target.
    """

    def __init__(self, drives: Mapping[int, str | None]) -> None:
        """`drives` has the name of each drive on the line; None for one that cannot be opened."""
        super().__init__()
        self._drives = drives

    def dialog(self) -> ComposeResult:
        """A field for the address, and the drive that has it."""
        with Vertical(id="place"):
            with Horizontal(id="row"):
                yield Plain(".", id="key")
                yield Plain("drive", id="label")
                yield NumberInput("", id="address", type="integer", max_length=3)
                yield Plain("", id="target")
            yield Plain(hint(("Enter", "Open"), ("Esc", "Cancel")), id="hint")

    def concerns(self, device: int) -> bool:
        """Return True: a stop of any drive discards what was typed."""
        return True

    @property
    def _address(self) -> int | None:
        text = self.query_one("#address", NumberInput).value
        return int(text) if text.isdecimal() else None

    def on_input_changed(self) -> None:
        """Show the drive that has the typed address."""
        self.query_one("#target", Plain).update(self._target_text(), layout=False)

    def _target_text(self) -> str:
        address = self._address
        if address is None:
            return ""
        if address not in self._drives:
            return NO_DRIVE_AT.format(address=address)
        name = self._drives[address]
        return NOT_IDENTIFIED.format(address=address) if name is None else f"→ {name}"

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer with the address of a drive; another address stays in the field."""
        address = self._address
        if address is None:
            self.answer(None)
        elif self._drives.get(address) is not None:
            self.answer(address)
