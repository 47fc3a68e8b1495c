"""Read and write access to a drive's words as its manual allows: limits, blocks, scanner,
ranges."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block, Function, Multiple, Parameter
from tui.drive.settings.limits import counts_of
from tui.drive.shown import depends_on
from tui.drive.values import from_words, is_enumeration, is_field, raw_range, to_words, word_count

from ..registers import Registers
from ..rules import Traits

NO_VALUE = 0x8000
OTHER_SPACES: Mapping[int, int] = {4: 0x10000, 1: 0x20000, 2: 0x30000}
"""First place of input registers, coils and inputs, by the function that reads them."""
BIT_FUNCTIONS, COIL_WRITES, WRITTEN_SPACES = (1, 2), (5, 15), (3, 1)
"""Functions that read bits, that write coils, and that read what can be written."""


class Refused(Exception):
    """A request that the drive refuses: an exception code, or None for no reply."""

    def __init__(self, code: int | None) -> None:
        super().__init__(code)
        self.code = code


class DriveWords:
    """Words of the drive's own server, with the access rules of its manual."""

    def __init__(
        self,
        profile: Profile,
        traits: Traits,
        registers: Registers,
        *,
        blocked: Callable[[Parameter], bool],
        written: Callable[[Parameter], None],
        unlimited: Callable[[], bool] = bool,
    ) -> None:
        """`unlimited` returns True while the drive ignores the ranges of its words."""
        self._profile = profile
        self._refusals = traits.refusals
        self._limits = traits.limits
        self._limits_follow = traits.limits_follow
        self._registers = registers
        self._blocked = blocked
        self._written = written
        self._unlimited = unlimited
        self._reading = profile.data.reading
        self._taught = {reference.parameter for reference in profile.data.teachable_references}
        """Words that accept a reference although no document describes them as writable."""
        self._scanner: dict[int, tuple[Block, int]] = {}
        """Words that mirror another parameter: their block and place in it."""
        for block in profile.data.blocks:
            if not block.fixed_start:
                for place, address in enumerate(self._value_addresses(block)):
                    self._scanner[address] = (block, place)

    def _value_addresses(self, block: Block) -> list[int]:
        if block.values:
            return [self._profile[code].address for code in block.values]
        return [block.address + place for place in range(block.max_words)]

    # Reading

    def read(self, address: int, count: int, function: Function) -> list[int]:
        """Return the words of a read; raises Refused as the drive would."""
        self._check_count(count, function.max_read, function)
        other = function.code in OTHER_SPACES
        block = None if other else self._fixed_block(address, count, "read")
        if block is not None:
            return [self._slot_word(block, place) for place in range(count)]
        bits = function.code in BIT_FUNCTIONS
        if self._reading.single_words_only and count != 1 and not bits:
            raise Refused(self._refusals.wrong_shape)
        if other:
            words = [self._other_word(function.code, a) for a in range(address, address + count)]
        else:
            words = [self._word(a) for a in range(address, address + count)]
        missing = words.count(None)
        if missing == count or (missing and not self._fills_gaps()):
            raise Refused(self._unknown_read())
        filler = 0 if bits else self._reading.unknown_word or 0
        return [filler if word is None else word for word in words]

    def _fills_gaps(self) -> bool:
        return self._reading.unknown_word is not None or self._reading.gaps_readable

    def _unknown_read(self) -> int | None:
        silent = self._refusals.unknown_address is None
        return None if silent else self._reading.unknown_exception

    def _other_word(self, function: int, address: int) -> int | None:
        """Return a coil, an input or an input register; None if there is none."""
        place = OTHER_SPACES[function] + address
        owner = self._registers.owner(place) if address <= 0xFFFF else None
        return self._registers.word(place) if owner is not None else None

    def _word(self, address: int) -> int | None:
        if address > 0xFFFF:
            return None
        if (place := self._scanner.get(address)) and place[0].direction == "read":
            return self._slot_word(*place)
        return self._registers.word(address) if self._registers.owner(address) else None

    def _fixed_block(self, address: int, count: int, direction: str) -> Block | None:
        for block in self._profile.data.blocks:
            if block.fixed_start and block.direction == direction and block.address == address:
                if not block.min_words <= count <= block.max_words:
                    raise Refused(self._refusals.wrong_shape)
                return block
        return None

    def _slot_word(self, block: Block, place: int) -> int:
        """Return the live word of a place of a block; 0 or `NO_VALUE` if it has no known target."""
        target = self._target(block, place)
        if target is None:
            return NO_VALUE if block.selects_by == "choice" else 0
        known = self._registers.owner(target)
        return self._registers.word(target) if known else NO_VALUE

    def _target(self, block: Block, place: int) -> int | None:
        """Return the target address of a place of a block; None if it has none."""
        if place >= len(block.slots):
            return None
        raw = self._registers.in_force(self._profile[block.slots[place]])
        if block.selects_by == "address":
            return (raw & 0xFFFF) or None
        chosen = next((c.parameter for c in block.choices if c.raw == raw), None)
        return self._profile[chosen].address if chosen else None

    # Writing

    def write(self, address: int, words: Sequence[int], function: Function) -> None:
        """Write words as the drive does; raises Refused.

        Unknown addresses and forbidden values refuse the whole request. A word that cannot be
        written now refuses the rest of it: the words before it have been written.
        """
        self._check_count(len(words), function.max_write, function)
        coils = function.code in COIL_WRITES
        address += OTHER_SPACES[1] if coils else 0
        block = self._fixed_block(address, len(words), "write") if len(words) > 1 else None
        if block is None and self._reading.single_words_only and len(words) != 1 and not coils:
            raise Refused(self._refusals.wrong_shape)
        entries = [
            (address + place, self._write_target(block, address, place), word)
            for place, word in enumerate(words)
        ]
        for _, target, word in entries:
            if target is not None:
                self._check_value(target, word)
        for place, (own, target, word) in enumerate(entries):
            if target is not None:
                after = entries[place + 1][1] if place + 1 < len(entries) else None
                self._apply(target, word, after)
            if own != target and block is None and self._registers.owner(own):
                self._registers.write_word(own, word)

    def _write_target(self, block: Block | None, address: int, place: int) -> int | None:
        if block is not None:
            target = self._target(block, place)
            if target is None:
                raise Refused(self._refusals.not_now)
            return target
        scanned = self._scanner.get(address + place)
        if scanned is None:
            return address + place
        if scanned[0].direction == "read":
            raise Refused(self._refusals.read_only)
        return self._target(*scanned)

    def _check_value(self, address: int, word: int) -> None:
        parameter = self._registers.owner(address)
        if parameter is None or parameter.function not in WRITTEN_SPACES:
            raise Refused(self._refusals.unknown_address)
        if self._unlimited():
            return
        for part in self._parts(parameter):
            if self._may_be_written(part) and word_count(part) == 1 and not part.is_bits:
                self._check_raw(part, from_words(part, [word]))

    def _parts(self, parameter: Parameter) -> list[Parameter]:
        """Return the parameters that share a register with this one, itself included."""
        if not is_field(parameter):
            return [parameter]
        place = (parameter.function, parameter.address)
        return [p for p in self._profile.parameters if (p.function, p.address) == place]

    def _check_raw(self, parameter: Parameter, raw: int) -> None:
        low, high = raw_range(parameter)
        names = self._profile.names(parameter)
        named = raw in names
        if not named and (not low <= raw <= high or (names and is_enumeration(parameter))):
            raise Refused(self._refusals.out_of_range)
        if self._within(parameter, raw) != raw and not self._limits_follow:
            raise Refused(self._refusals.out_of_range)

    def _within(self, parameter: Parameter, raw: int) -> int:
        """Return the raw value reduced to the parameters that limit it."""
        if self._unlimited():
            return raw
        for code, bound in ((parameter.min_from, max), (parameter.max_from, min)):
            limit = self._registers.named(code) if code else None
            same = (parameter.unit, parameter.scale, parameter.offset)
            if limit and (limit.unit, limit.scale, limit.offset) == same:
                raw = bound(raw, self._registers.present(limit))
        for of, bound in ((parameter.min_of, max), (parameter.max_of, min)):
            if of is not None and (counts := self._counts(parameter, of)) is not None:
                raw = bound(raw, counts)
        own = self._registers.named(self._limits.get(parameter.code, ""))
        return raw if own is None else min(raw, self._registers.in_force(own))

    def _counts(self, parameter: Parameter, of: Multiple) -> int | None:
        source = self._profile[of.parameter]
        codes = [of.parameter, *depends_on(parameter), *depends_on(source)]
        raws = {code: self._registers.present(self._profile[code]) for code in codes}
        return counts_of(self._profile, parameter, of, raws)

    def _apply(self, address: int, word: int, after: int | None) -> None:
        """Write a word; the drive acts on two words of one value once both are in place.

        `after` is the address of the next word of the request.
        """
        parameter = self._registers.owner(address)
        assert parameter is not None
        if not self._may_be_written(parameter):
            raise Refused(self._refusals.read_only)
        if self._blocked(parameter):
            raise Refused(self._refusals.not_now)
        if word_count(parameter) == 1:
            raw = self._within(parameter, from_words(parameter, [word]))
            word = to_words(parameter, raw, word)[0]
        self._registers.write_word(address, word)
        if after is None or self._registers.owner(after) is not parameter:
            self._written(parameter)

    def _may_be_written(self, parameter: Parameter) -> bool:
        return parameter.access != "r" or parameter.code in self._taught

    def _check_count(self, count: int, limit: int | None, function: Function) -> None:
        if count < 1:
            raise Refused(self._refusals.wrong_shape)
        if limit is not None and count > limit:
            raise Refused(past_limit(function, self._refusals.wrong_shape))


def past_limit(function: Function, refusal: int | None) -> int | None:
    """Return the refusal of a request beyond a function's limit: an exception, or None for no
    reply."""
    silent = function.past_limit == "silence" or refusal is None
    return None if silent else function.past_limit_exception
