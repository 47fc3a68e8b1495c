"""Faults of a line that show during a search: an echo, and refusals of a gateway."""

from __future__ import annotations

from tui.bus.api import ModbusLine
from tui.bus.link import TcpLink

from ..connect.addresses import addresses_text
from .asking import last_time
from .gateway_probe import GATEWAY_CODES
from .reply_evidence import ECHO_NOTE, REFUSED, TCP_HEAD


class LineRemarks:
    """Remarks on a line from its frames; call `look` often, as a line keeps few frames."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._last = last_time(line.trace)
        self._echoes = 0
        self._refused: dict[int, set[int]] = {}
        """Addresses that a gateway did not reach, by its exception."""

    def look(self) -> None:
        """Evaluate the frames since the last call."""
        tcp = isinstance(self._line.link, TcpLink)
        for frame in self._line.trace:
            if frame.time <= self._last or frame.direction == "out":
                continue
            body = frame.data[TCP_HEAD:] if tcp else frame.data
            self._echoes += frame.note.startswith(ECHO_NOTE)
            if len(body) > 2 and body[1] & REFUSED and body[2] in GATEWAY_CODES:
                self._refused.setdefault(body[2], set()).add(body[0])
        self._last = max(self._last, last_time(self._line.trace))

    @property
    def texts(self) -> list[str]:
        """Return a sentence for each fault; none if there was none."""
        found = []
        if self._echoes:
            found.append(
                f"The adapter repeats what it sends: {self._echoes} requests came back as an echo."
            )
        for code, devices in sorted(self._refused.items()):
            who = addresses_text(sorted(devices))
            found.append(f"The gateway answers {GATEWAY_CODES[code]}: address {who}.")
        return found
