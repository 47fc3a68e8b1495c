"""Keys from the sequences of terminals: PuTTY in its modes, rxvt, consoles, tmux, screen, xterm.

A sequence of a key yields that key, even if it arrives in parts. An unknown sequence is swallowed
whole. No stop key is lost in a sequence without an end. The caller passes all times, in seconds of
one clock.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from tui.safety import BURST_GAP

from .names import SPACE, SPACE_ALONE, STOP_KEYS, Named, character_name, sequence_name, with_alt
from .tokens import (
    EIGHT_BIT,
    ESC,
    ESCAPED,
    LONGEST_KEY,
    LONGEST_REPLY,
    MOUSE,
    PASTE_BEGINS,
    PASTE_ENDS,
    REPLY_BEGINS,
    REPLY_ENDS,
    REPORT,
    RXVT,
    KeyToken,
    Paste,
    Report,
    Token,
)

ESCAPE_DELAY: Final = 0.1
"""Default seconds after which ESC alone is the key Escape; Textual's setting overrides it."""

SEQUENCE_WITHIN: Final = 1.0
"""Seconds that an unfinished sequence waits for its next character."""


class Tokenizer:
    """Splits input, read piece by piece, into tokens.

    `mouse`: the terminal was asked for mouse reports and the kitty protocol.
    """

    def __init__(self, *, mouse: bool = False, escape_delay: float = ESCAPE_DELAY) -> None:
        self._mouse = mouse
        self._escape_delay = escape_delay
        self._state: Callable[[str], None] = self._ground
        self._text = ""
        self._long: list[str] = []
        self._began = self._last = self._before = self._now = 0.0
        self._mark: object = None
        self._here: object = None
        self._alt = self._mute = False
        self._cut: tuple[Any, ...] | None = None
        """A sequence interrupted by another one; it continues if that one was a report."""
        self._late_until = self._late_before = float("-inf")
        """End of the time in which the rest of a sequence may follow an ESC that counted as the key
        Escape; and that time as of the beginning of the present sequence, which may be a report in
        between."""
        self._found: list[Token] = []

    def feed(self, text: str, now: float, mark: object = None) -> list[Token]:
        """Add what was read at this time, and return the finished tokens."""
        self._end_waiting(now)
        self._now, self._here = now, mark
        if not self._stops_inside(text):
            for character in text:
                self._before, self._last = self._last, now
                self._state(character)
        return self._given()

    def tick(self, now: float) -> list[Token]:
        """Return the tokens that end by this time because nothing more was read."""
        self._end_waiting(now)
        return self._given()

    @property
    def deadline(self) -> float | None:
        """The time at which `tick` must be called; None if nothing waits."""
        return None if self._state == self._ground else self._last + self._patience

    @property
    def pending(self) -> float | None:
        """When an unfinished sequence that may become a key began, or None."""
        may_be = self._state not in (self._ground, self._reply, self._paste)
        return self._began if may_be and not self._mute else None

    @property
    def _patience(self) -> float:
        short = self._state in (self._escape, self._opening)
        return self._escape_delay if short else SEQUENCE_WITHIN

    def _given(self) -> list[Token]:
        found, self._found = self._found, []
        return found

    def _begin(self, text: str = "", *, mute: bool = False) -> None:
        """Begin a key or a sequence with the present read."""
        self._text, self._long = text, []
        self._began, self._mark = self._now, self._here
        self._alt, self._mute, self._cut = False, mute, None

    def _key(self, named: Named | None) -> None:
        """Emit a key, and end its sequence."""
        self._state = self._ground
        if named is None or (self._mute and named[0] not in STOP_KEYS):
            return
        name, character = named
        if self._alt and name not in STOP_KEYS:
            name, character = f"alt+{name.removeprefix('alt+')}", None
        self._found.append(KeyToken(name, character, self._began, self._now, self._mark))

    def _escape_key(self) -> None:
        self._found.append(KeyToken("escape", ESC, self._began, self._began, self._mark))

    def _ground(self, character: str) -> None:
        """Outside a sequence: a key, or the first character of a sequence."""
        late, self._late_before = self._now <= self._late_until, self._late_until
        self._late_until = float("-inf")
        if late and character in "[O":
            # the rest of a sequence whose ESC counted as the key Escape
            self._begin(ESC, mute=True)
            self._introduce(character)
        elif character == ESC:
            self._begin(ESC)
            self._state = self._escape
        elif (second := EIGHT_BIT.get(character)) is not None:
            self._begin(ESC)
            self._introduce(second)
        else:
            self._begin()
            self._key(character_name(character))

    def _escape(self, character: str) -> None:
        """After ESC."""
        if character == ESC:
            together = self._now == self._began and not self._alt
            if not together:
                self._escape_key()
            self._late_before = self._began + self._escape_delay + SEQUENCE_WITHIN
            self._begin(ESC)
            self._alt = together  # ESC twice at once is Alt with what follows
        elif (second := EIGHT_BIT.get(character, character)) in ESCAPED:
            self._introduce(second)
        else:
            self._key(SPACE_ALONE if character == " " else with_alt(character))

    def _introduce(self, character: str) -> None:
        self._text += character
        states = {"[": self._csi, "O": self._ss3}
        self._state = states.get(character, self._opening)

    def _broken(self, character: str) -> bool:
        """Return True if a character cannot belong to the sequence, and so ends it."""
        if character == ESC or character in EIGHT_BIT:
            cut = self._state, self._text, self._began, self._mark, self._alt, self._mute
            self._ground(character)
            self._cut = *cut, self._before
        elif character == " ":
            self._begin()
            self._key(SPACE_ALONE)
        elif not "\x20" < character < "\x7f":
            self._state = self._ground
        else:
            return False
        return True

    def _csi(self, character: str) -> None:
        """After ESC [."""
        if self._broken(character):
            return
        if character == "[" and self._text == "\x1b[":
            self._state = self._linux
        ends = character >= "\x40" or (character == "$" and RXVT.fullmatch(self._text))
        self._text += character
        if self._text == "\x1b[M" and self._mouse:
            self._state = self._mouse_place
        elif ends and self._state == self._csi:
            self._finish()

    def _linux(self, character: str) -> None:
        """After ESC [ [: the Linux console's F1 to F5 have one more character."""
        if not self._broken(character):
            self._text += character
            if character >= "\x40":
                self._finish()

    def _ss3(self, character: str) -> None:
        """After ESC O."""
        if self._broken(character):
            return
        self._text += character
        if character >= "\x40":
            self._finish()

    def _mouse_place(self, character: str) -> None:
        """After ESC [ M with mouse reports: a button and a position."""
        self._text += character
        if character == ESC or character in EIGHT_BIT:
            self._ground(character)  # the rest of the report was lost
        elif len(self._text) == len("\x1b[M") + 3:
            self._finish()

    def _finish(self) -> None:
        """Handle a complete sequence."""
        text, self._state = self._text, self._ground
        if text == PASTE_BEGINS:
            self._state = self._paste
        elif REPORT.fullmatch(text) or (self._mouse and MOUSE.fullmatch(text)):
            self._found.append(Report(text))
            self._go_on()
        else:
            named = sequence_name(text[: LONGEST_KEY + 1], kitty=self._mouse)
            self._key(named)
            if named is None:
                self._go_on()

    def _go_on(self) -> None:
        """Continue the interrupted sequence: what interrupted it was not a key."""
        self._late_until = self._late_before
        if self._cut is not None:
            # its timeout counts from its own last character: reports come twice a second
            *cut, self._last = self._cut
            (self._state, self._text, self._began, self._mark, self._alt, self._mute) = cut
            self._cut = None

    def _opening(self, character: str) -> None:
        """After ESC ], ESC P or ESC _: a reply, or a key with Alt."""
        second = self._text[-1]
        if character in REPLY_BEGINS[second]:
            self._state = self._reply
        else:
            self._key(with_alt(second))
            self._state(character)

    def _reply(self, character: str) -> None:
        """In a reply, whose contents are ignored."""
        if character == ESC:
            self._began, self._mark = self._now, self._here
            self._state = self._reply_escape
        elif character in REPLY_ENDS:
            self._state = self._ground
            self._go_on()
        elif character in EIGHT_BIT:
            self._ground(character)  # the end was lost: this begins another sequence
        else:
            self._long.append(character)
            if len(self._long) > LONGEST_REPLY:
                self._no_reply()

    def _reply_escape(self, character: str) -> None:
        """After ESC in a reply: its end, or the beginning of another sequence."""
        if character == "\\":
            self._reply(REPLY_ENDS[0])
            return
        began, mark = self._began, self._mark
        self._begin(ESC)
        self._began, self._mark, self._state = began, mark, self._escape
        self._escape(character)

    def _no_reply(self) -> None:
        """Give up a reply without an end; a Space in it counts as typed."""
        spaced = " " in self._long
        self._begin()
        self._key(SPACE if spaced else None)

    def _paste(self, character: str) -> None:
        """Inside a paste."""
        self._long.append(character)
        if character == "~" and "".join(self._long[-len(PASTE_ENDS) :]) == PASTE_ENDS:
            self._pasted(self._long[: -len(PASTE_ENDS)])

    def _pasted(self, text: list[str]) -> None:
        pasted = "".join(text).replace("\x00", "")
        self._found.append(Paste(pasted.encode(errors="replace").decode(), self._now))
        self._state = self._ground

    def _stops_inside(self, text: str) -> bool:
        """Return True if a read is a single stop key inside an unfinished paste or reply.

        A Space read alone, some time after the rest, was pressed. If the end of a paste or a reply
        is lost, no stop may be lost with it.
        """
        if self._state not in (self._paste, self._reply) or self._now - self._last <= BURST_GAP:
            return False
        named = SPACE_ALONE if text == " " else sequence_name(text[:LONGEST_KEY])
        if named is None or named[0] not in STOP_KEYS:
            return False
        self._found.append(KeyToken(*named, self._now, self._now, self._here))
        return True

    def _end_waiting(self, now: float) -> None:
        """End a sequence that has waited too long for its next character."""
        if (deadline := self.deadline) is None or now < deadline:
            return
        state, self._state = self._state, self._ground
        if state == self._escape:
            if self._alt:
                self._escape_key()
            self._escape_key()
            self._late_until = deadline + SEQUENCE_WITHIN
        elif state == self._opening:
            self._key(with_alt(self._text[-1]))
        elif state in (self._reply, self._reply_escape):
            self._no_reply()
        elif state == self._paste:
            self._end_paste(now)

    def _end_paste(self, now: float) -> None:
        """End a paste without its end sequence; the first part of that sequence may have come."""
        whole = "".join(self._long)
        cut = next(n for n in range(len(PASTE_ENDS) - 1, -1, -1) if whole.endswith(PASTE_ENDS[:n]))
        self._pasted(self._long[: len(whole) - cut])
        if cut == 1:
            self._late_until = now + SEQUENCE_WITHIN
        elif cut:
            self._begin(PASTE_ENDS[:cut])
            self._state, self._last = self._csi, now
