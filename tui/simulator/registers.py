"""Words of a simulated drive: present, in force, saved; held and protected ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.settings.writable import is_setting
from tui.drive.values import from_words, is_field, to_words, type_range, word_count

from .errors import SimulatorError

UNKEPT_QUANTITIES = frozenset(
    {
        "command_word",
        "command_word_2",
        "extended_command_word",
        "command_frequency",
        "command_speed",
    }
)
"""Quantities that are commands of the line: no family keeps them over a power-down."""


class RegisterMap:
    """Places of all parameters of a profile, and those that a drive keeps."""

    def __init__(self, profile: Profile) -> None:
        self._parameters = profile.parameters
        self.folded = {p.code.casefold(): p for p in profile.parameters}
        """Parameters by their codes in lower case."""
        self.whole: dict[str, tuple[int, int, int]] = {}
        """Address and range of each parameter that is one whole word: nearly every one."""
        self.fields: dict[int, int] = {}
        """Bits of a whole word that are parameters of their own, by address."""
        self.owner: dict[int, Parameter] = {}
        """The first parameter at each address, also at those of copies in EEPROM."""
        self.copies: dict[int, int] = {}
        """Addresses in RAM, by those of their copies in EEPROM."""
        for parameter in profile.parameters:
            addresses = _addresses(parameter)
            if is_field(parameter):
                bits = parameter.mask << parameter.shift & 0xFFFF
                self.fields[addresses[0]] = self.fields.get(addresses[0], 0) | bits
            elif len(addresses) == 1:
                self.whole[parameter.code] = (addresses[0], *type_range(parameter))
            for address in addresses:
                self.owner.setdefault(address, parameter)
            if parameter.eeprom_address is not None:
                for place, address in enumerate(addresses):
                    self.copies[parameter.eeprom_address + place] = address
        self.owner |= {copy: self.owner[address] for copy, address in self.copies.items()}
        # words that only the drive itself changes, and those that it forgets at power-down
        self.own = {address for address, p in self.owner.items() if p.access == "r"}
        self.volatile = {address for address, p in self.owner.items() if is_volatile(p)}

    def store(self, parameter: Parameter, raw: int, *memories: dict[int, int]) -> None:
        """Put a raw value, limited to its type, into words by address."""
        if (whole := self.whole.get(parameter.code)) is not None:
            # the drive shows about twenty values at each time step
            address, low, high = whole
            word = min(max(raw, low), high) & 0xFFFF
            if (fields := self.fields.get(address)) is not None:
                word = word & ~fields | memories[0].get(address, 0) & fields
            for words in memories:
                words[address] = word
            return
        low, high = type_range(parameter)
        for words in memories:
            _put_words(words, parameter, min(max(raw, low), high))

    def words(self, raws: Mapping[str, int]) -> dict[int, int]:
        """Return the words of all parameters, from their raw values by code."""
        words: dict[int, int] = {}
        for parameter in self._parameters:
            self.store(parameter, raws[parameter.code], words)
        return words


@lru_cache(maxsize=32)
def register_map(profile: Profile) -> RegisterMap:
    """Return the map of a profile; a line may have thirty drives of one."""
    return RegisterMap(profile)


class Registers:
    """Words by place (wire address and address space), and parameters by code.

    A written word is *present* at once. It is *in force* at once, or after the next power-up if the
    profile says so. It is *saved* at once if the drive writes its EEPROM, on command if the drive
    has a working copy, and never if it is in volatile memory only.
    """

    def __init__(
        self, profile: Profile, initial: Mapping[int, int], factory: Mapping[int, int]
    ) -> None:
        """`initial` and `factory` are words by place, as `RegisterMap.words` returns them."""
        self.profile = profile
        self._map = register_map(profile)
        self._words = dict(initial)
        self._in_force = dict(initial)
        self._factory = factory
        self._held: set[str] = set()
        self._protected: set[int] = set()
        self._saved = {a: word for a, word in initial.items() if a not in self._map.own}

    # Access by the line

    def owner(self, address: int) -> Parameter | None:
        """Return the parameter of a word; None for an unknown or protected word."""
        return None if address in self._protected else self._map.owner.get(address)

    def word(self, address: int) -> int:
        """Return the present word at a known address."""
        copied = self._map.copies.get(address)
        return self._words[address] if copied is None else self._saved[copied]

    def write_word(self, address: int, word: int) -> None:
        """Write a word from the line; storage and effect follow the profile.

        A write to the copy of a setting in EEPROM sets the one in RAM, too.
        """
        parameter = self._map.owner[address]
        if (copied := self._map.copies.get(address)) is not None:
            self._saved[copied] = word & 0xFFFF
            address = copied
        self._words[address] = word & 0xFFFF
        if parameter.effective == "at-once" and not self._waits(parameter):
            self._in_force[address] = word & 0xFFFF
        if parameter.storage in ("eeprom", "unknown") and address not in self._map.volatile:
            self._saved[address] = word & 0xFFFF

    def _waits(self, parameter: Parameter) -> bool:
        """Return True if a written word is used only after the family's entering word."""
        return self.profile.data.memory.enter is not None and is_setting(self.profile, parameter)

    # Access by the drive

    def named(self, code: str) -> Parameter | None:
        """Return the parameter with this code in any case, or None."""
        return self._map.folded.get(code.casefold())

    def present(self, parameter: Parameter) -> int:
        """Return the raw value that the line reads."""
        return from_words(parameter, [self._words[a] for a in _addresses(parameter)])

    def in_force(self, parameter: Parameter) -> int:
        """Return the raw value on which the drive acts."""
        if (whole := self._map.whole.get(parameter.code)) is not None:
            word = self._in_force[whole[0]]
            return word if word <= whole[2] else word - 0x10000
        return from_words(parameter, [self._in_force[a] for a in _addresses(parameter)])

    def put(self, parameter: Parameter, raw: int) -> None:
        """Show a raw value of the drive's own; a held parameter keeps its set value."""
        if parameter.code not in self._held:
            self._store(parameter, raw)

    def settle(self, parameter: Parameter, raw: int) -> None:
        """Put a raw value in force, present and saved, as if it had always been set."""
        self._store(parameter, raw)
        for address in _addresses(parameter):
            self._saved[address] = self._words[address]

    def hold(self, parameter: Parameter) -> None:
        """Keep a monitored value constant, whatever the motor does."""
        self._held.add(parameter.code)

    def protect(self, parameters: Iterable[Parameter]) -> None:
        """Hide parameters from the line."""
        self._protected = {a for p in parameters for a in _addresses(p)}

    # Memory

    def save(self) -> None:
        """Copy the present words to the EEPROM, as a save command does."""
        for address, word in self._words.items():
            if address not in self._map.volatile and address not in self._map.own:
                self._saved[address] = word

    def restore(self, *, volatile_only: bool = False) -> None:
        """Replace the present words by the saved ones, as at power-up; optionally only those not
        kept."""
        saved = {
            a: w for a, w in self._saved.items() if a in self._map.volatile or not volatile_only
        }
        self._words.update(saved)
        self._in_force.update(saved)

    def recall(self, keep: frozenset[str]) -> None:
        """Replace the present words by the saved ones, except those whose code is in `keep`."""
        for address, word in self._saved.items():
            if address not in self._map.volatile and self._map.owner[address].code not in keep:
                self._words[address] = self._in_force[address] = word

    def to_factory(self, keep: frozenset[str]) -> None:
        """Set every writable parameter to its factory value, except those whose code is in
        `keep`."""
        for parameter in self.profile.parameters:
            if parameter.access == "r" or is_volatile(parameter) or parameter.code in keep:
                continue
            self.make_factory(parameter)

    def make_factory(self, parameter: Parameter) -> None:
        """Set one parameter to its factory value."""
        for address in _addresses(parameter):
            self._words[address] = self._in_force[address] = self._factory[address]

    def _store(self, parameter: Parameter, raw: int) -> None:
        self._map.store(parameter, raw, self._words, self._in_force)


def is_volatile(parameter: Parameter) -> bool:
    """Return True if a parameter is in volatile memory only: so declared, or a command of the
    line."""
    return (
        parameter.storage == "ram"
        or parameter.access == "w"
        or parameter.quantity in UNKEPT_QUANTITIES
    )


def typed_raw(parameter: Parameter, raw: int) -> int:
    """Return a raw value in the parameter's type, whether given signed or as a word.

    Raises SimulatorError if it does not fit.
    """
    low, high = type_range(parameter)
    span = high - low + 1
    if not -span // 2 <= raw < span:
        raise SimulatorError(f"{parameter.code}: {raw} does not fit {parameter.type}.")
    if raw > high:
        return raw - span
    return raw + span if raw < low else raw


def _addresses(parameter: Parameter) -> range:
    return range(parameter.place, parameter.place + word_count(parameter))


def _put_words(words: dict[int, int], parameter: Parameter, raw: int) -> None:
    """Put a raw value into words by address; other fields of the same word stay."""
    addresses = _addresses(parameter)
    reported = to_words(parameter, raw, words.get(addresses[0], 0))
    words.update(zip(addresses, reported, strict=True))
