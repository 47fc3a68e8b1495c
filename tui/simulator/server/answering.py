"""Station of a drive on the line, and its addresses: its own server and those of its cards.

Thread-safe: every change of a word holds the drive's lock.

Source of the cards' words: ATV71 Modbus manual, function 3, examples 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Function, LinkChoice, LinkSetting, Parameter

from ..body import Body
from ..registers import Registers
from ..rules import Refusals
from ..spec import LineTiming
from .access import Refused, past_limit
from .client_settings import ClientSettings
from .functions import Server

SHORTEST_TURNAROUND = 0.0015
"""Least turnaround in s: PX-MODBUS manual 4, 15.06."""
FORMAT_ROLES = ("baud", "format", "parity")


class Station:
    """Effect of the link settings in force on one drive."""

    def __init__(self, profile: Profile, registers: Registers, address: int) -> None:
        self._profile = profile
        self._registers = registers
        self._given = address
        self._settings: list[tuple[LinkSetting, Parameter]] = []

    def settle(self, timing: LineTiming) -> None:
        """Set the drive to the settings of the line, as far as its choices allow."""
        roles: set[str] = set()
        for setting in self._profile.data.link.settings:
            fitting = [c.raw for c in setting.choices if _fits(c, timing)]
            if setting.role in FORMAT_ROLES and setting.role not in roles and fitting:
                parameter = self._profile[setting.parameter]
                self._registers.settle(parameter, fitting[0])
                self._settings.append((setting, parameter))
                roles.add(setting.role)

    def settle_address(self) -> None:
        """Set the drive's address parameter."""
        if parameter := self._address_parameter():
            self._registers.settle(parameter, self._given)

    def _address_parameter(self) -> Parameter | None:
        for setting in self._profile.data.link.settings:
            if setting.role == "address":
                return self._profile[setting.parameter]
        return self._profile.quantity("line_address")

    @property
    def address(self) -> int:
        """The present address of the drive."""
        parameter = self._address_parameter()
        return self._registers.in_force(parameter) if parameter else self._given

    @property
    def is_group(self) -> bool:
        """True if the drive's own address calls a group, so that it never answers there."""
        return self._profile.data.addresses.zero_digit_is_group and "0" in str(self.address)

    def is_called(self, address: int) -> bool:
        """Return True if a broadcast or group address includes this drive."""
        addresses = self._profile.data.addresses
        if not self.address:
            return False
        if address == addresses.broadcast:
            return True
        return addresses.zero_digit_is_group and in_group(self.address, address)

    @property
    def turnaround(self) -> float:
        """Return the time from the end of a request to the start of the reply, in s."""
        for setting in self._profile.data.link.settings:
            if setting.role == "delay":
                delay = self._registers.in_force(self._profile[setting.parameter])
                return max(delay / 1000, SHORTEST_TURNAROUND)
        return float(self._profile.data.link.turnaround_ms) / 1000

    def hears(self, timing: LineTiming, client: ClientSettings | None = None) -> bool:
        """Return True if the drive's protocol, baud and format in force are those of the line.

        `client` holds the settings of the other side; if visible, they replace those of the line.
        """
        for setting in self._profile.data.link.settings:
            if setting.role == "protocol" and setting.factory is not None:
                protocol = self._registers.in_force(self._profile[setting.parameter])
                if protocol != setting.factory:
                    return False
        choices = self._chosen()
        if client is not None:
            return client.fits(*_own(choices, timing))
        return all(_fits(choice, timing) for choice in choices)

    def own(self, timing: LineTiming) -> LineTiming:
        """Return the timing by the drive's own settings; those of the line if no word of the drive
        sets them."""
        baud, form = _own(self._chosen(), timing)
        return LineTiming(baud, form, timing.real_time)

    def _chosen(self) -> list[LinkChoice]:
        """Return the settings in the drive's words for baud and format, as far as it has any."""
        chosen = []
        for setting, parameter in self._settings:
            raw = self._registers.in_force(parameter)
            chosen += [choice for choice in setting.choices if choice.raw == raw][:1]
        return chosen


def in_group(own: int, called: int) -> bool:
    """Return True if a group address includes an address: a zero digit matches any digit but 0."""
    mine, theirs = str(own), str(called)
    if called == 0 or "0" not in theirs or "0" in mine or len(mine) != len(theirs):
        return False
    return all(t in ("0", m) for m, t in zip(mine, theirs, strict=True))


def _own(choices: list[LinkChoice], timing: LineTiming) -> tuple[int, str]:
    """Return baud and format of a drive; those of the line if no word of the drive sets them."""
    baud, form = timing.baud, timing.format
    for choice in choices:
        baud = choice.baud or baud
        form = choice.format or (f"8{choice.parity}{form[2]}" if choice.parity else form)
    return baud, form


def _fits(choice: LinkChoice, timing: LineTiming) -> bool:
    """Return True if a choice agrees with the line, as far as it defines baud or format."""
    return (
        choice.baud in (None, timing.baud)
        and choice.format in (None, timing.format)
        and choice.parity in (None, timing.format[1])
    )


MEMORY_WORDS = 2048
"""%MW0 to %MW2047 of the programmable card."""
IP_ADDRESS = range(60006, 60010)
"""IPC1 to IPC4 of the Ethernet card."""


class CardWords:
    """Known words of a card, some of them writable."""

    def __init__(self, known: Mapping[int, int], *, writable: bool, refusals: Refusals) -> None:
        self.words = dict(known)
        self._writable = writable
        self._refusals = refusals

    def read(self, address: int, count: int, function: Function) -> list[int]:
        """Return the words of a read; raises Refused if one does not exist."""
        self._check(address, count, function.max_read, function)
        return [self.words[a] for a in range(address, address + count)]

    def write(self, address: int, words: Sequence[int], function: Function) -> None:
        """Write words; raises Refused if one does not exist or is read-only."""
        self._check(address, len(words), function.max_write, function)
        if not self._writable:
            raise Refused(self._refusals.read_only)
        self.words.update(enumerate(words, start=address))

    def _check(self, address: int, count: int, limit: int | None, function: Function) -> None:
        if count < 1:
            raise Refused(self._refusals.wrong_shape)
        if limit is not None and count > limit:
            raise Refused(past_limit(function, self._refusals.wrong_shape))
        if not all(a in self.words for a in range(address, address + count)):
            raise Refused(self._refusals.unknown_address)


def card_words(parameter: str, refusals: Refusals) -> CardWords | None:
    """Return the words of the server whose address this parameter sets; None if unknown."""
    if parameter.casefold() == "amoa":
        return CardWords(dict.fromkeys(range(MEMORY_WORDS), 0), writable=True, refusals=refusals)
    if parameter.casefold() == "amoc":
        return CardWords(dict.fromkeys(IP_ADDRESS, 0), writable=False, refusals=refusals)
    return None


def card_word(name: str) -> tuple[str, int] | None:
    """Return server and address of a card's word by its name (`%MW20`, `IPC1`); None for others."""
    folded = name.strip().casefold()
    if folded.startswith("%mw") and folded[3:].isdecimal():
        return "amoa", int(folded[3:])
    if folded in ("ipc1", "ipc2", "ipc3", "ipc4"):
        return "amoc", IP_ADDRESS[int(folded[3]) - 1]
    return None


CARD_FUNCTIONS = (3, 6, 16, 23)
"""Functions of the drive that the servers of its cards support."""


class Answering:
    """Replies of a drive on the line; none while its supply is off."""

    def __init__(
        self,
        body: Body,
        station: Station,
        own: Server,
        *,
        heard: Callable[[], None],
        lock: AbstractContextManager[object],
    ) -> None:
        self._body = body
        self._station = station
        self._own = own
        self._heard = heard
        self._lock = lock
        self._cards: dict[str, tuple[CardWords, Server]] = {}
        known = {code: f for code, f in own.functions.items() if code in CARD_FUNCTIONS}
        for server in body.profile.data.addresses.servers:
            words = card_words(server.parameter, body.traits.refusals)
            if words is not None:
                card = Server(words, known, body.traits.refusals)
                self._cards[server.parameter.casefold()] = (words, card)

    def put_card_word(self, name: str, raw: int) -> bool:
        """Put a raw value into a card's word (`%MW..`, `IPC1`..`IPC4`); False if it has another
        name."""
        found = card_word(name)
        if found is None or found[0] not in self._cards:
            return False
        self._cards[found[0]][0].words[found[1]] = raw & 0xFFFF
        return True

    def answers_at(self, address: int) -> bool:
        """Return True if one of the drive's servers has this address and replies at it."""
        return self._connected and self._server_at(address) is not None

    @property
    def _connected(self) -> bool:
        """True if the drive has its supply and its wire to the line."""
        return self._body.powered and not self._body.conditions.wire_cut

    def _server_at(self, address: int) -> Server | None:
        if address == 0:
            return None
        if address == self._station.address and not self._station.is_group:
            return self._own
        for code, (_, server) in self._cards.items():
            if self._body.setting(code, 0) == address:
                return server
        return None

    def is_own(self, address: int) -> bool:
        """Return True if the drive's own server, not that of a card, has this address."""
        return self._connected and self._server_at(address) is self._own

    def is_called(self, address: int) -> bool:
        """Return True if a broadcast or group address means this drive too."""
        return self._connected and self._station.is_called(address)

    def answer(self, address: int, pdu: bytes) -> bytes | None:
        """Return the reply of the server at an address; None for no reply."""
        with self._lock:
            server = self._server_at(address) if self._body.powered else None
            if server is None:
                return None
            if server is self._own:
                server.counters.count_frame()
                self._heard()
                self._show_counters()
            reply = server.answer(pdu)
            self._show_counters()
            return reply

    def obey(self, pdu: bytes) -> None:
        """Execute a broadcast or a call to a group, without a reply."""
        with self._lock:
            function = self._body.profile.function(pdu[0]) if pdu else None
            if self._body.powered and function is not None and function.broadcast:
                self._own.answer(pdu)

    def count_checksum_error(self) -> None:
        """Count a frame to this drive with a wrong checksum."""
        with self._lock:
            self._own.counters.count_checksum_error()
            self._show_counters()

    def _show_counters(self) -> None:
        self._body.show_code("M1CT", self._own.counters.frames)
        self._body.show_code("M1EC", self._own.counters.checksum_errors)
