"""Addresses of a drive: its own server and those of its cards.

Thread-safe: every change of a word holds the drive's lock.

Source of the cards' words: ATV71 Modbus manual, function 3, examples 2 and 3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager

from tui.drive.profile.schema import Function

from ..body import Body
from ..rules import Refusals
from .access import Refused, past_limit
from .functions import Server
from .station import Station

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
