"""Addresses of a drive: its own server and those of its cards.

Thread-safe: every change of a word holds the drive's lock.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

from ..body import Body
from .cards import CardWords, card_word, card_words
from .functions import Server
from .station import Station

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
        return self._body.powered and self._server_at(address) is not None

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
        return self._body.powered and self._server_at(address) is self._own

    def is_called(self, address: int) -> bool:
        """Return True if a broadcast or group address means this drive too."""
        return self._body.powered and self._station.is_called(address)

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
