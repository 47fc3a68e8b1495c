"""Reference of a drive of any make: the word that the line wrote last, or an analog input."""

from __future__ import annotations

from tui.drive.profile.schema import Parameter

from ..body import Body

FULL_REFERENCES = {"%": 100.0, "V": 10.0}
"""Full reference in relative units."""
UNGIVEN_HZ = 30.0
"""Reference in Hz of a drive that the line can run without giving a reference."""


class OwnReference:
    """Reads the reference of one drive after its profile."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def hz(self, *, by_line: bool) -> float:
        """Return the reference in Hz, within the limits of the profile's words."""
        body = self._body
        size = self._given() if by_line else self._full * body.terminals.level("AI1")
        high = min(body.value("high_speed", 1e9) or 1e9, body.value("max_frequency", 1e9) or 1e9)
        cut = min(max(abs(size), body.value("low_speed", 0.0)), high)
        return -cut if size < 0 else cut

    @property
    def _full(self) -> float:
        body = self._body
        rated = body.value("rated_frequency", body.rating.frequency) or body.rating.frequency
        return body.value("high_speed", 0.0) or body.value("max_frequency", 0.0) or rated

    def _given(self) -> float:
        written = self._latest()
        if written is not None:
            return self._in_hz(written)
        if self._body.earlier_hz is not None:
            return self._body.earlier_hz
        return 0.0 if self._words() else UNGIVEN_HZ

    def _words(self) -> list[Parameter]:
        body = self._body
        named = (body.registers.named(way.parameter) for way in body.profile.data.references)
        known = (body.parameter("command_frequency"), body.parameter("command_speed"))
        return list({p.code: p for p in (*known, *named) if p is not None}.values())

    def _latest(self) -> Parameter | None:
        """Return the reference word that the line wrote last; None if it wrote none."""
        orders = self._body.line_orders
        words = [word for word in self._words() if orders.given_at(word)]
        return max(words, key=orders.given_at, default=None)

    def _in_hz(self, word: Parameter) -> float:
        return self._body.engineering(word) * self._hertz_of_one(word)

    def _hertz_of_one(self, word: Parameter) -> float:
        """Return the Hz of one unit of a word; percentages and volts are relative to the full
        reference."""
        if word.unit in FULL_REFERENCES:
            return self._whole(word) / FULL_REFERENCES[word.unit]
        if not self._is_speed(word) and word.unit != "rpm":
            return 1.0
        poles = round(self._body.value("motor_poles", self._body.rating.poles)) or 4
        return poles / 120

    def _whole(self, word: Parameter) -> float:
        """Return the Hz of the full reference of a word."""
        rating = self._body.registers.named(word.rating) if word.rating else None
        if rating is None:
            return self._full
        return self._body.engineering(rating) * self._hertz_of_one(rating)

    def _is_speed(self, word: Parameter) -> bool:
        ways = self._body.profile.data.references
        way = next((way for way in ways if way.parameter == word.code), None)
        return way.kind == "speed" if way else word.quantity == "command_speed"

    @property
    def is_earlier(self) -> bool:
        """True if the reference is still that of another master."""
        return self._body.earlier_hz is not None and self._latest() is None

    def leave(self, hz: float) -> None:
        """Put a reference in Hz into the line's word, as another master does."""
        self._body.earlier_hz = hz
        words = [word for word in self._words() if not self._is_speed(word)]
        if words:
            value = self._body.scale(words[0]) * self._hertz_of_one(words[0])
            self._body.registers.put(words[0], round(hz / value))

    def wire(self, hz: float) -> None:
        """Set the analog input to the value for this reference in Hz."""
        self._body.terminals.apply("AI1", hz / self._full)
