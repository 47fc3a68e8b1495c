"""What is told of drives that are stopped: lines as each stands, or one JSON document."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from ..commands.orders import complain
from ..shared.errors import DONE
from ..shared.say import say


class StopTelling:
    """Tells each drive as soon as it is known, and keeps all for JSON."""

    def __init__(self, line_text: str, *, as_json: bool) -> None:
        self.as_json = as_json
        self._line_text = line_text
        self.documents: list[dict[str, Any]] = []

    def stopped(self, device: int, profile: str | None, text: str) -> None:
        """A motor stands."""
        if not self.as_json:
            with suppress(OSError):  # a reader that went away must not end the other stops
                say(text)
        self._keep(device, profile, text, DONE)

    def failed(self, device: int, profile: str | None, text: str, status: int) -> None:
        """A motor is not known to stand."""
        complain(text)
        self._keep(device, profile, text, status)

    def silent(self, devices: list[int], status: int) -> None:
        """Nobody answered at these addresses; a status other than 0 where somebody was to."""
        complain(f"No answer at {', '.join(map(str, devices))}.")
        for device in devices if status else ():
            self._keep(device, None, "No answer.", status)

    def gave_back(self, text: str) -> None:
        """The control of the one drive was given back to its terminals."""
        if not self.as_json:
            say(text)
        self.documents[-1]["given_back"] = text

    def _keep(self, device: int, profile: str | None, text: str, status: int) -> None:
        told = {"line": self._line_text, "device": device, "profile": profile}
        self.documents.append({**told, "stopped": not status, "text": text, "status": status})
