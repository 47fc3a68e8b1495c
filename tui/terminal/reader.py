"""From the bytes of a terminal to keys with their strokes; stop keys are taken on the way.

Runs in the thread that reads the keys, so that a stop waits neither for the screen nor for what
the terminal takes.
"""

from __future__ import annotations

import codecs
import logging
from typing import Protocol

from .bursts import Bursts
from .dialects import ESCAPE_DELAY, Tokenizer
from .names import STOP_KEYS
from .stroke import Pressed
from .tokens import KeyToken, Paste, Report, Token

log = logging.getLogger(__name__)

MAY_STOP = (b" ", b"\x1b")
"""One of these is in the bytes of every stop key, whatever terminal sends it."""
EDITING = frozenset({"backspace", "delete", "left", "right", "home", "end"})
"""Keys that edit a text, besides those that write it; any other one may leave it."""


class Stops(Protocol):
    """Calls to the app in the thread that reads the keys."""

    def take_stop_key(self, key: str, left_at: float | None = None) -> bool:
        """Stop, if the key means that now; True if it was taken.

        `left_at` is when a key was read that may leave the text which a Space would belong to.
        """

    def acts_at_once(self, key: str, character: str | None, *, begins: bool, after: float) -> bool:
        """Return True if a key need not wait until it is known whether it came alone.

        It can then only move a cursor, write text or, if it `begins` a burst, show something. The
        keys up to the one that was read at the time `after` have had their whole effect.
        """

    def stop_stamp(self) -> object:
        """Another object after every stop."""

    def last_stop(self, error: Exception) -> None:
        """Stop every drive: keys, or what they do, failed by an internal error."""

    def sequence_swallowed(self, data: bytes) -> None:
        """A sequence came that no known terminal sends; it did nothing."""


TerminalInput = Pressed | Paste | Report


class KeyReader:
    """Takes bytes and times, returns the messages for the app."""

    def __init__(
        self, stops: Stops, *, mouse: bool = False, escape_delay: float = ESCAPE_DELAY
    ) -> None:
        self._stops = stops
        self._mouse, self._escape_delay = mouse, escape_delay
        self._begin()

    def _begin(self) -> None:
        """Nothing is known of the bytes before."""
        # a byte that is no text stays what it is: it may begin a sequence
        self._decode = codecs.getincrementaldecoder("utf-8")("surrogateescape").decode
        self._tokens = Tokenizer(mouse=self._mouse, escape_delay=self._escape_delay)
        self._bursts = Bursts()
        self._left_at: float | None = None
        self._read_at = float("-inf")
        """When the last key was read that was no stop."""

    def read(self, data: bytes, now: float, stamp: object = None) -> list[TerminalInput]:
        """Bytes that were read at this time, when the app's stamp of stops was this."""
        try:
            return self._read(data, now, stamp)
        except Exception as error:
            return self._failed(error, data)

    def _read(self, data: bytes, now: float, stamp: object) -> list[TerminalInput]:
        tokens = self._tokens.feed(self._decode(data), now, stamp)
        if not tokens and self._tokens.pending is None and data.startswith(b"\x1b"):
            self._stops.sequence_swallowed(data)
        return self._sorted(tokens, now)

    def tick(self, now: float) -> list[TerminalInput]:
        """Return the input known by this time because nothing more was read."""
        try:
            return self._sorted(self._tokens.tick(now), now)
        except Exception as error:
            # what a sequence was that had begun is not known
            return self._failed(error, MAY_STOP[1])

    def _failed(self, error: Exception, data: bytes) -> list[TerminalInput]:
        """Stop every drive if the lost bytes may have been a stop key; then begin again."""
        log.error("keys could not be read", exc_info=error)
        try:
            if any(item in data for item in MAY_STOP):
                self._stops.last_stop(error)
        except Exception:
            log.exception("no drive was stopped")
        self._begin()
        return []

    @property
    def deadline(self) -> float | None:
        """When `tick` has something to do, or None."""
        found = [self._tokens.deadline, self._bursts.deadline(self._tokens.pending)]
        return min((time for time in found if time is not None), default=None)

    def _sorted(self, tokens: list[Token], now: float) -> list[TerminalInput]:
        reports: list[TerminalInput] = []
        # keys of one read have one time: which of them had its effect would not be known
        single = len(tokens) == 1 and self._tokens.pending is None
        for token in tokens:
            if isinstance(token, Report):
                reports.append(token)
            elif isinstance(token, Paste):
                self._bursts.paste(token)
            elif self._stopped(token):
                self._bursts.stop(token)
                self._left_at = None
            else:
                self._left_at = self._left(token)
                self._bursts.key(token, at_once=single and self._at_once(token))
                self._read_at = token.began
        return [*reports, *self._bursts.given(now, self._tokens.pending)]

    def _at_once(self, key: KeyToken) -> bool:
        """Return True if a key does not wait: it can do no harm, and overtakes none."""
        begins, last = self._bursts.begins(key), self._read_at
        return not self._bursts.holds_back and self._stops.acts_at_once(
            key.name, key.character, begins=begins, after=last
        )

    def _stopped(self, key: KeyToken) -> bool:
        """Return True if a key was a stop."""
        return key.name in STOP_KEYS and self._stops.take_stop_key(key.name, self._left(key))

    def _left(self, key: KeyToken) -> float | None:
        """When a key was read last, up to this one, that may leave a text."""
        writes = key.character is not None and key.character.isprintable()
        return self._left_at if writes or key.name in EDITING else key.began
