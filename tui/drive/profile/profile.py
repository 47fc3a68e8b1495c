"""Loaded profile: parameters by code, number, address and quantity; help on faults."""

from __future__ import annotations

import difflib
import re
import zlib
from collections.abc import Callable, Collection, Iterable, Mapping
from decimal import Decimal
from functools import cached_property, lru_cache
from hashlib import sha256

import msgspec

from tui.wire.frames import SPACES

from ..errors import ProfileError, UnknownParameter
from ..teaching import TaughtScale
from .schema import (
    AlarmHelp,
    Chart,
    FaultCode,
    FaultHelp,
    Function,
    HelpData,
    Parameter,
    ParameterGroup,
    ProfileData,
    Quantity,
)


class FaultGuide:
    """Help of faults and alarms; its file is read on first use, not with the profile."""

    def __init__(self, profile: ProfileData, read: Callable[[], HelpData] | None = None) -> None:
        self._numbered = bool(profile.faults.codes)
        self._rows = HelpData(faults=list(profile.faults.help))
        self._read = read
        self.trouble = ""
        """Why its file could not be read; empty if it was read, or not needed yet."""

    @cached_property
    def data(self) -> HelpData:
        """All help; raises ProfileError if the file is wrong."""
        return self._read() if self._read is not None else self._rows

    @cached_property
    def _found(self) -> tuple[dict[int | None, FaultHelp], dict[tuple[str, int], AlarmHelp]]:
        """Help by raw fault, and by word and bit; empty, without an error, if the file is wrong."""
        try:
            reported = self.data
        except ProfileError as error:
            self.trouble = str(error).partition("\n")[0]
            reported = self._rows
        return {fault.raw: fault for fault in reported.faults}, {
            (a.word, a.bit): a for a in reported.alarms
        }

    def fault(self, raw: int | None) -> FaultHelp | None:
        """Return the help on a fault by its raw code; None if nothing is known.

        A family whose trips have no numbers has a single help for all of them, with the key None.
        """
        return self._found[0].get(raw if self._numbered else None)

    def alarm(self, word: str, bit: int) -> AlarmHelp | None:
        """Return the help on an alarm bit; None if nothing is known."""
        return self._found[1].get((word, bit))


_HEX = re.compile(r"^(?:16#|0x)([0-9a-f]+)$", re.IGNORECASE)
_WORD = re.compile(r"^w ?([0-9 ]+)$", re.IGNORECASE)

UNVERIFIED = frozenset({"analogy", "unverified"})


def is_verified(parameter: Parameter) -> bool:
    """Return True if a manual or a public document of this family confirms the parameter."""
    return parameter.confidence not in UNVERIFIED


def proof_text(profile: Profile) -> str:
    """Return, as a clause, how much of an unproved profile the evidence of this site has proved."""
    proved = sum(parameter.confidence == "site" for parameter in profile.parameters)
    orders = [order for chart in profile.data.charts for order in chart.orders]
    followed = sum(order.confidence == "site" for order in orders)
    if not proved and not followed:
        return "no drive has confirmed it"
    commands = f"{followed} of its {len(orders)} commands" if followed else "no command"
    return f"this site has proved {proved} of its {len(profile.parameters)} values and {commands}"


LONGEST_UNPACKED = 1 << 24
"""Most bytes of an unpacked profile."""


@lru_cache(maxsize=32)
def digest_of(profile: Profile) -> str:
    """Return the SHA-256 of a profile without its help, in hexadecimal."""
    return sha256(msgspec.json.encode(profile.data)).hexdigest()


def unpacked_profile(packed: bytes) -> Profile:
    """Unpack a profile that another process has packed. Raises ProfileError."""
    try:
        text = zlib.decompressobj().decompress(packed, LONGEST_UNPACKED)
        return Profile(msgspec.json.decode(text, type=ProfileData))
    except (zlib.error, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ProfileError(f"Another program sent a damaged profile: {error}") from error


class Profile:
    """Description of a drive family, with the look-ups that the other packages need."""

    def __init__(
        self,
        data: ProfileData,
        read_help: Callable[[], HelpData] | None = None,
        *,
        taught: Mapping[str, TaughtScale] | None = None,
    ) -> None:
        self.data = data
        self.read_help = read_help
        self.guide = FaultGuide(data, read_help)
        self.taught: Mapping[str, TaughtScale] = taught or {}
        """Learned scales of one drive, by code; the family's file does not have them."""
        self.parameters = tuple(data.parameters)
        self._by_code = {p.code: p for p in self.parameters}
        self._by_folded = _unique(self.parameters)
        self._by_address: dict[tuple[int, int], Parameter] = {}
        for parameter in self.parameters:
            self._by_address.setdefault((parameter.function, parameter.address), parameter)
        self._by_quantity: dict[Quantity, Parameter] = {
            p.quantity: p for p in self.parameters if p.quantity is not None
        }
        self._enumerations = {
            e.id: {int(raw): text for raw, text in e.values.items()} for e in data.enumerations
        }
        self._functions = {f.code: f for f in data.functions}
        self._faults = {f.raw: f for f in data.faults.codes}

    def __repr__(self) -> str:
        return f"Profile({self.id!r})"

    @property
    def id(self) -> str:
        return self.data.profile.id

    @property
    def name(self) -> str:
        return self.data.profile.name

    @property
    def vendor(self) -> str:
        return self.data.profile.vendor

    def __getitem__(self, code: str) -> Parameter:
        """Return the parameter with exactly this code; raises UnknownParameter."""
        try:
            return self._by_code[code]
        except KeyError:
            raise UnknownParameter(f"{self.name} has no parameter {code!r}.") from None

    def get(self, code: str) -> Parameter | None:
        """Return the parameter with exactly this code; None if there is none."""
        return self._by_code.get(code)

    def at(self, address: int, function: int = 3) -> Parameter | None:
        """Return the parameter at a wire address, the first one if several share it; None if none.

        `function` is 4 for an input register, 1 for a coil, 2 for a discrete input.
        """
        return self._by_address.get((function, address))

    def quantity(self, quantity: Quantity) -> Parameter | None:
        """Return the family's parameter for a quantity, or None."""
        return self._by_quantity.get(quantity)

    def function(self, code: int) -> Function | None:
        """Return a supported Modbus function with its limits; None if it is not supported."""
        return self._functions.get(code)

    def fault(self, raw: int) -> FaultCode | None:
        """Return the fault of a raw fault code; None if the profile does not list it."""
        return self._faults.get(raw)

    @cached_property
    def packed(self) -> bytes:
        """Return the profile without its help as bytes, for another process; see
        `unpacked_profile`."""
        return zlib.compress(msgspec.json.encode(self.data), 1)

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Groups of parameters in the order of the profile."""
        return tuple(dict.fromkeys(p.group for p in self.parameters))

    def names(self, parameter: Parameter) -> Mapping[int, str]:
        """Return the names of a parameter's raw values; its own override the enumeration's."""
        own = {int(raw): text for raw, text in parameter.values.items()}
        return {**self._enumerations.get(parameter.enumeration, {}), **own}

    def find(self, text: str) -> Parameter:
        """Find a parameter by typed text: a code, a number of the manual or a wire address.

        Codes in any case come first (`acc`, `1.05`, `F875`), then numbers of the manual
        (`W9001`, `16#FD00`), then a wire address in decimal or hexadecimal. Raises
        UnknownParameter with the nearest codes.
        """
        wanted = text.strip()
        exact = self._by_code.get(wanted) or self._by_folded.get(wanted.casefold())
        if exact is not None:
            return exact
        address = parse_address(wanted)
        found = (self.at(address, space) for space in SPACES) if address is not None else ()
        if (at_address := next(filter(None, found), None)) is not None:
            return at_address
        near = difflib.get_close_matches(wanted.casefold(), self._by_folded, n=3, cutoff=0.5)
        hint = ", ".join(dict.fromkeys(self._by_folded[n].code for n in near))
        way = f"Did you mean {hint}?" if hint else "Type a code, W9001, 16#2329 or 9001."
        raise UnknownParameter(f"{self.name} has no parameter {text!r}. {way}")

    def chart(self, raws: Mapping[str, int]) -> Chart | None:
        """Return the active state chart, from raw values by code: the first whose condition
        holds."""
        fallback: Chart | None = None
        for chart in self.data.charts:
            if chart.when is None:
                fallback = fallback or chart
            elif chart.when.holds(raws):
                return chart
        return fallback or (self.data.charts[0] if self.data.charts else None)

    def scale(
        self, parameter: Parameter, raws: Mapping[str, int], absent: Collection[str] = ()
    ) -> Decimal | None:
        """Return the value of one count, from raw values by code.

        `absent` names parameters that the drive reported as missing. None if the scale depends on a
        parameter whose value is unknown, or on a full scale of 0: then the value must be shown raw
        and never written.
        """
        if (full := parameter.full_scale) is not None:
            source, raw = self[full.parameter], raws.get(full.parameter)
            # at a full scale of 0 no count means anything
            return None if not raw else raw * Decimal(source.scale) / full.counts
        follows = parameter.scale_by
        if follows is None:
            return Decimal(parameter.scale)
        text = follows.scales.get(str(raws.get(follows.parameter)))
        if text is None and follows.parameter in absent:
            text = follows.absent
        return Decimal(text) if text is not None else None

    def unit(self, parameter: Parameter, raws: Mapping[str, int]) -> str:
        """Return the unit of a parameter, from raw values by code; `raw` if it is not known."""
        reported = parameter.unit_by
        if reported is None:
            return parameter.unit
        word = raws.get(reported.parameter)
        if word is None:
            return "raw"
        return reported.units.get(str(word >> reported.shift & reported.mask), "raw")


def mark_of(profile: Profile, parameter: Parameter) -> str:
    """Return the mark of a value that no document states for sure: `taught` or `?`."""
    if parameter.code in profile.taught:
        return "taught"
    return "" if is_verified(parameter) else "?"


# cached because every row of a table calls it, and a profile does not change
@lru_cache(maxsize=32)
def group_by_id(profile: Profile) -> Mapping[str, ParameterGroup]:
    """Return, by name, the groups whose contents the profile describes."""
    return {group.name: group for group in profile.data.groups}


def group_holds(profile: Profile, parameter: Parameter) -> str:
    """Return the kind of the parameter's group: settings, commands or measurements."""
    group = group_by_id(profile).get(parameter.group)
    return group.holds if group is not None else "settings"


def parse_address(text: str) -> int | None:
    """Parse a wire address: `W9001`, `16#2329`, `0x2329` or `9001`; None for other text."""
    if match := _HEX.match(text):
        address = int(match[1], 16)
    elif match := _WORD.match(text):
        address = int(match[1].replace(" ", ""))
    elif text.isdecimal():
        address = int(text)
    else:
        return None
    return address if address <= 0xFFFF else None


def notations(parameter: Parameter) -> tuple[str, str, str]:
    """Return the three notations of a parameter: drive code, manual's number, wire address."""
    kind = f"{_KINDS[parameter.function]} " if parameter.is_bits else ""
    wire = f"{kind}{parameter.address} (16#{parameter.address:04X})"
    return parameter.code, parameter.number, wire


_KINDS = {1: "coil", 2: "input"}


def _unique(parameters: Iterable[Parameter]) -> dict[str, Parameter]:
    """Return parameters by case-folded code and number, without ambiguous names."""
    found: dict[str, Parameter] = {}
    shared: set[str] = set()
    for parameter in parameters:
        for name in {parameter.code.casefold(), parameter.number.casefold()}:
            if name in found and found[name] is not parameter:
                shared.add(name)
            found[name] = parameter
    return {name: p for name, p in found.items() if name not in shared}
