"""Communication map of a drive: channels with their words, and four words of a person's choice.

Every family has it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from tui.drive.bit_texts import short_bit, true_bits
from tui.drive.blocks.user_words import FORMATS, UserWord, UserWords
from tui.drive.communication_words import communication_words
from tui.drive.profile.schema import Block
from tui.drive.shown import shown
from tui.drive.signal_path import Signal, path_state, source_name, source_word
from tui.drive.values import NOT_AVAILABLE
from tui.safety import LOOK_IS_OLD

from .blocks.editor import read_words
from .blocks.proposals import watched_first
from .console import DriveConsole


@dataclass(frozen=True, slots=True)
class MapRow:
    """One row of the map."""

    head: str
    text: str
    detail: str = ""
    """True texts of the bits, or the name of the word."""


@dataclass(slots=True)
class CommunicationMap:
    """Rows of the map from values that are current: those older than 10 s are `-----`."""

    console: DriveConsole
    _raws_of_words: dict[UserWord, int] = field(default_factory=dict)
    """Raw words of a person's choice at the last read."""
    _read_at: float = -math.inf

    @property
    def codes(self) -> list[str]:
        """All codes of the map, apart from those of the signal paths."""
        profile = self.console.session.profile
        found = [parameter.code for parameter in communication_words(profile).values()]
        found += [way.parameter for way in profile.data.references]
        for block in profile.data.blocks:
            found += [*block.slots, *block.values] if block.values else []
        return list(dict.fromkeys(found))

    @property
    def rows(self) -> list[MapRow]:
        """The channels, the command and status words, the references, and the scanners."""
        profile = self.console.session.profile
        words = [
            MapRow(parameter.code, self._text(parameter.code), self._bits(parameter.code))
            for parameter in communication_words(profile).values()
        ]
        references = [
            MapRow(way.parameter, self._text(way.parameter), profile[way.parameter].name)
            for way in profile.data.references
        ]
        scanners = [row for block in profile.data.blocks if (row := self._scanner(block))]
        return [*self._channels(), *references, *scanners, *words]

    def _channels(self) -> Iterator[MapRow]:
        profile, raws = self.console.session.profile, self._raws
        titles: tuple[tuple[Signal, str], ...] = (
            ("command", "Command"),
            ("reference", "Reference"),
        )
        for carries, title in titles:
            state = path_state(profile, carries, raws)
            if state is None:
                continue
            if state.live is None:
                yield MapRow(title, "not known", state.unknown)
                continue
            code = source_word(state.live, raws)
            word = f"{code} {self._text(code)}" if code else ""
            yield MapRow(title, source_name(profile, state.live, raws), word)

    def _scanner(self, block: Block) -> MapRow | None:
        """Return the words of a scanner that are mapped, with the parameters in their slots."""
        profile, raws = self.console.session.profile, self._raws
        if not block.values:
            return None
        by_address = {parameter.address: parameter for parameter in profile.parameters}
        parts = []
        for slot, code in zip(block.slots, block.values, strict=False):
            target = by_address.get(raws.get(slot, 0))
            if target is not None:
                raw = raws.get(code)
                text = NOT_AVAILABLE if raw is None else f"16#{raw & 0xFFFF:04X}"
                parts.append(f"{code} {target.code} {text}")
        unread = any(slot not in raws for slot in block.slots)
        return MapRow(block.name, NOT_AVAILABLE if unread else ", ".join(parts) or "no word mapped")

    @property
    def _raws(self) -> Mapping[str, int]:
        return self.console.session.image.fresh(LOOK_IS_OLD)

    def _text(self, code: str) -> str:
        profile, raws = self.console.session.profile, self._raws
        raw = raws.get(code)
        return NOT_AVAILABLE if raw is None else shown(profile, profile[code], raw, raws).display

    def _bits(self, code: str) -> str:
        raw = self._raws.get(code)
        if raw is None:
            return ""
        bits = true_bits(self.console.session.profile[code].bits, raw)
        return ", ".join(filter(None, (short_bit(bit, on=on) for bit, on in bits)))

    # Words of a person's choice, which Scanner shows too

    @property
    def own(self) -> UserWords:
        """The four words; an address of 0 means none."""
        return self.console.blocks.words

    @property
    def useful(self) -> list[str]:
        """Codes of the monitored values that are not among the words."""
        profile = self.console.session.profile
        chosen = {word.address for word in self.own}
        codes = [code for code in watched_first(profile) if profile[code].is_register]
        return [code for code in codes if profile[code].address not in chosen]

    async def read_own(self) -> None:
        """Read the words. Raises the line's errors."""
        session, words = self.console.session, self.own
        found = await read_words(session, words)
        pairs = zip(words, found, strict=True)
        self._raws_of_words = {word: raw for word, raw in pairs if raw is not None}
        self._read_at = session.clock.monotonic()

    def own_text(self, word: UserWord) -> tuple[str, str]:
        """Return the name and the present value of a word; `-----` if it was not read just now."""
        session = self.console.session
        parameter = session.profile.at(word.address) if word.address else None
        is_old = session.clock.monotonic() - self._read_at > LOOK_IS_OLD
        raw = None if is_old else self._raws_of_words.get(word)
        if not word.address:
            return "", NOT_AVAILABLE
        name = (
            f"{parameter.code} {parameter.name}" if parameter is not None else "not in the profile"
        )
        return name, word.text(raw)

    def choose(self, place: int, code: str) -> None:
        """Put a parameter into a place; an empty code clears it."""
        address = self.console.session.profile[code].address if code else 0
        self._put(place, UserWord(address, self.own[place].format))

    def turn_format(self, place: int, step: int) -> None:
        """Give a word the next format, or the previous one."""
        word = self.own[place]
        at = (FORMATS.index(word.format) + step) % len(FORMATS)
        turned = UserWord(word.address, FORMATS[at])
        if word in self._raws_of_words:
            self._raws_of_words[turned] = self._raws_of_words[word]
        self._put(place, turned)

    def _put(self, place: int, word: UserWord) -> None:
        words = [*self.own]
        words[place] = word
        self.console.blocks.assign_words(tuple(words))
