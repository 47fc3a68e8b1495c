"""From a terminal's bytes to keys with their strokes: alone, together, or held down.

Stop keys are handled on the way. Runs in the thread that reads the keys, so that a stop waits
neither for the screen nor for the terminal's output.

A person types one key after another. A paste without brackets, or a link that hung, delivers many
at once. A key that can do no harm in a burst does not wait, but counts as one of its keys. The
caller of `Bursts` passes all times, in seconds of one clock.
"""

from __future__ import annotations

import codecs
import logging
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, Protocol

from tui.safety import BURST_GAP

from .dialects import ESCAPE_DELAY, Tokenizer
from .names import STOP_KEYS
from .stroke import Pressed, Stroke
from .tokens import KeyToken, Paste, Report, Token

SHORTEST_REPEAT: Final = 0.005
"""Seconds between two keys below which no keyboard repeats."""

UNEVEN: Final = 0.02
"""Seconds by which the intervals between repeats of a held key may differ."""

REPEATS: Final = 3
"""Keys at an even pace that count as a held key."""

HELD_LONGEST: Final = 0.15
"""Seconds after which keys that did not arrive alone are held back no longer."""

STEPPING: Final = frozenset({"up", "down", "left", "right", "pageup", "pagedown"})
"""Keys that a person holds down to step repeatedly."""


class Bursts:
    """Holds keys back until it is known if they arrived alone."""

    def __init__(self) -> None:
        self._waiting: list[KeyToken] = []
        self._last = float("-inf")
        self._members = 0
        self._names: set[str] = set()
        self._reads: list[list[KeyToken]] = []
        self._repeating: str | None = None
        self._stepped = False
        self._given: list[Pressed | Paste] = []

    def begins(self, key: KeyToken) -> bool:
        """Return True if this key would be the first of its burst."""
        return key.began - self._last > BURST_GAP

    @property
    def holds_back(self) -> bool:
        """True if a key waits: a later one must not overtake it."""
        return bool(self._waiting)

    def key(self, key: KeyToken, *, at_once: bool = False) -> None:
        """Add a key; `given` returns it once it is classified, or next if it acts `at_once`."""
        self._join(key.began, key.at)
        if not self._reads or self._reads[-1][-1].at != key.at:
            self._reads = [*self._reads[1 - REPEATS :], []]
        self._reads[-1].append(key)
        self._names.add(key.name)
        if at_once:
            stroke = Stroke(key.began, key.mark, alone=False, steps=False, at_once=True)
            self._given.append(Pressed(key.name, key.character, stroke))
        else:
            self._waiting.append(key)

    def stop(self, key: KeyToken) -> None:
        """Discard all waiting keys, because a stop key was handled."""
        self._waiting.clear()
        self._given = [given for given in self._given if isinstance(given, Paste)]
        self._join(key.began, key.at)
        self._repeating, self._stepped, self._reads = None, True, []

    def paste(self, paste: Paste) -> None:
        """Add a paste in its place among the keys; keys close to it do not count as alone."""
        self._join(paste.at, paste.at)
        self._give_parts()
        self._given.append(paste)

    def given(self, now: float, pending: float | None = None) -> list[Pressed | Paste]:
        """Return the classified keys.

        `pending` is when an unfinished sequence that may become a key began.
        """
        self._give_repeats()
        if not self._hangs_on(pending):
            if now - self._last > BURST_GAP:
                self._close()
            elif self._members > 1 and self._waiting and now - self._waiting[0].at > HELD_LONGEST:
                self._give_parts()
        found, self._given = self._given, []
        return found

    def deadline(self, pending: float | None = None) -> float | None:
        """When the waiting keys will be classified; None if that does not depend on time."""
        return self._last + BURST_GAP if self._waiting and not self._hangs_on(pending) else None

    def _hangs_on(self, pending: float | None) -> bool:
        return pending is not None and pending - self._last <= BURST_GAP

    def _join(self, began: float, at: float) -> None:
        """Count a member of the burst; begin a new burst if the last one is over."""
        if began - self._last > BURST_GAP:
            self._close()
        self._members += 1
        self._last = at

    def _close(self) -> None:
        """End the burst."""
        if self._members == 1 and self._waiting:
            self._give(self._waiting.pop(), alone=True, steps=True)
        self._give_parts()
        self._members, self._names, self._reads = 0, set(), []
        self._repeating, self._stepped = None, False

    def _give(
        self, key: KeyToken, *, steps: bool, alone: bool = False, held: bool = False, piece: int = 1
    ) -> None:
        stroke = Stroke(key.began, key.mark, alone=alone, held=held, steps=steps, piece=piece)
        self._given.append(Pressed(key.name, key.character, stroke))

    def _give_parts(self) -> None:
        """Emit the waiting keys as parts of a burst; if all are one arrow, the first may step."""
        steps = not self._stepped and len(self._names) == 1 and self._names <= STEPPING
        for key in self._waiting:
            self._give(key, steps=steps, piece=self._members)
            self._stepped, steps = self._stepped or steps, False
        self._waiting.clear()

    def _give_repeats(self) -> None:
        """Emit the repeats of a held key, one per read."""
        if not self._waiting or not self._reads:
            return
        last = self._reads[-1]
        if all(key.name == self._repeating for key in last):
            self._give_held(1, len(last))
        elif _even(self._reads):
            self._repeating = last[0].name
            self._give_held(REPEATS, REPEATS)
        else:
            self._repeating = None

    def _give_held(self, count: int, run: int) -> None:
        """Emit `count` of the last `run` waiting keys as held, and the others as parts."""
        first = max(0, len(self._waiting) - run)
        ahead, held = self._waiting[:first], self._waiting[first : first + count]
        behind = self._waiting[first + count :]
        self._waiting = ahead
        self._give_parts()
        self._stepped = True
        for key in held:
            self._give(key, held=True, steps=True, piece=self._members)
        self._waiting = behind
        self._give_parts()


def _even(reads: Sequence[Sequence[KeyToken]]) -> bool:
    """Return True if each of these reads is the same key, at an even pace."""
    names = {key.name for read in reads for key in read}
    if len(reads) < REPEATS or len(names) != 1 or not names <= STEPPING:
        return False
    times = [read[0].at for read in reads]
    between = [later - earlier for earlier, later in pairwise(times)]
    alone = all(len(read) == 1 for read in reads)
    return alone and min(between) >= SHORTEST_REPEAT and max(between) - min(between) <= UNEVEN


log = logging.getLogger(__name__)

MAY_STOP = (b" ", b"\x1b")
"""The bytes of every stop key contain one of these, on any terminal."""
EDITING = frozenset({"backspace", "delete", "left", "right", "home", "end"})
"""Keys that edit a text, besides typed characters; any other key may leave the field."""


class Stops(Protocol):
    """Calls to the app in the thread that reads the keys."""

    def take_stop_key(self, key: str, left_at: float | None = None) -> bool:
        """Stop if the key is a stop key now; True if it was handled.

        `left_at` is when a key was read that may have left the text field, in which a Space would
        be text.
        """

    def acts_at_once(self, key: str, character: str | None, *, begins: bool, after: float) -> bool:
        """Return True if a key need not wait until it is known whether it came alone.

        It can then only move a cursor, write text or, if it `begins` a burst, show something. The
        keys up to the one that was read at the time `after` have had their whole effect.
        """

    def stop_stamp(self) -> object:
        """Return a value that changes with every stop."""

    def last_stop(self, error: Exception) -> None:
        """Stop every drive, after an internal error in the handling of keys."""

    def sequence_swallowed(self, data: bytes) -> None:
        """Note a sequence that no known terminal sends; it had no effect."""


TerminalInput = Pressed | Paste | Report


class KeyReader:
    """Turns bytes and their times into messages for the app."""

    def __init__(
        self, stops: Stops, *, mouse: bool = False, escape_delay: float = ESCAPE_DELAY
    ) -> None:
        self._stops = stops
        self._mouse, self._escape_delay = mouse, escape_delay
        self._begin()

    def _begin(self) -> None:
        """Start without any earlier bytes."""
        # a byte that is not valid UTF-8 is kept: it may begin a sequence
        self._decode = codecs.getincrementaldecoder("utf-8")("surrogateescape").decode
        self._tokens = Tokenizer(mouse=self._mouse, escape_delay=self._escape_delay)
        self._bursts = Bursts()
        self._left_at: float | None = None
        self._read_at = float("-inf")
        """When the last key was read that was no stop."""

    def read(self, data: bytes, now: float, stamp: object = None) -> list[TerminalInput]:
        """Handle bytes read at this time, when the app's stop stamp had this value."""
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
            # an unfinished sequence may have been a stop key
            return self._failed(error, MAY_STOP[1])

    def _failed(self, error: Exception, data: bytes) -> list[TerminalInput]:
        """Stop every drive if the lost bytes may have been a stop key; then start again."""
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
        """The time at which `tick` must be called, or None."""
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
        """When the last key that may leave a text field was read, up to this one."""
        writes = key.character is not None and key.character.isprintable()
        return self._left_at if writes or key.name in EDITING else key.began
