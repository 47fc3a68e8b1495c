"""Ghost of a recorded drive: it answers as the drive did, at the times of its record.

A request that the record has is answered as it was: by a value, a refusal or nothing. A read that
it has not is answered from its other reads, if they cover it. All else is refused.
"""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import NamedTuple

from tui.drive.profile.profile import Profile

from .rules import Refusals, traits_of

GHOST_BITS = (1, 2)
GHOST_READS = (*GHOST_BITS, 3, 4)
"""Functions that read bits or words, whose values the record has by address."""
GHOST_WRITES = (5, 6, 15, 16)
ECHO_REQUEST = bytes([8, 0, 0])
"""Beginning of a request that is to be returned."""
GHOST_REFUSALS = Refusals(1, 2, 2, 3, 4, 3)
"""Refusals of a drive whose profile is not known."""
SHORTEST_RECORD = 1.0
"""Least time in s after which a record begins again."""


class RecordedExchange(NamedTuple):
    """One exchange of the record; request and reply are function and data."""

    at: float
    """Time of the request, in s since the first one."""
    took: float
    """Time in s from the end of the request to the end of the reply; 0 if it is not known."""
    request: bytes
    reply: bytes | None
    """None if no valid reply came."""


class GhostReply(NamedTuple):
    """A reply and the time after which its end arrives, in s."""

    data: bytes
    took: float


class _Track:
    """Values by time: the last one holds until the next, the first one from the beginning."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._items: list[tuple[float, bytes | None]] = []

    def add(self, at: float, took: float, data: bytes | None) -> None:
        self._times.append(at)
        self._items.append((took, data))

    def at(self, now: float) -> tuple[float, bytes | None]:
        """Return what held at a time: how long the reply took, and its data."""
        return self._items[max(0, bisect_right(self._times, now) - 1)]


class GhostDrive:
    """A drive played from a record; its time begins with the first request.

    At the end, the record begins again, or the ghost falls silent. `report` receives sentences: the
    end of the record, and each request that it does not have, once. Raises ValueError for no
    exchanges.
    """

    def __init__(
        self,
        address: int,
        exchanges: Sequence[RecordedExchange],
        profile: Profile | None = None,
        *,
        repeats: bool = True,
        clock: Callable[[], float] = time.monotonic,
        report: Callable[[str], None] = lambda text: None,
    ) -> None:
        if not exchanges:
            raise ValueError(f"The record has no exchange with device {address}.")
        self.address = address
        self.profile = profile
        self.report = report
        self._clock = clock
        self._repeats = repeats
        self._begun: float | None = None
        self._rounds = 0
        self._unknown: set[bytes] = set()
        self._requests: dict[bytes, _Track] = {}
        self._words: dict[tuple[int, int], _Track] = {}
        self._any = _Track()
        for item in sorted(exchanges, key=lambda exchange: exchange.at):
            self._add(item)
        last = max(item.at + item.took for item in exchanges)
        self.length = max(SHORTEST_RECORD, last)
        """Length of the record, in s."""
        self._refusals = GHOST_REFUSALS if profile is None else traits_of(profile).refusals

    def _add(self, item: RecordedExchange) -> None:
        track = self._requests.setdefault(_kind(item.request), _Track())
        track.add(item.at, item.took, item.reply)
        self._any.add(item.at, item.took, item.reply)
        if _is_good_read(item):
            assert item.reply is not None
            for place, address in enumerate(_addresses(item.request)):
                word = _value(item.reply, place)
                track = self._words.setdefault((item.request[0], address), _Track())
                track.add(item.at, item.took, word)

    def answer(self, pdu: bytes) -> GhostReply | None:
        """Return the reply to a request without address and checksum; None for no reply."""
        now = self._position()
        if now is None or not pdu:
            return None
        track = self._requests.get(_kind(pdu))
        if track is not None:
            took, reply = track.at(now)
            if reply is not None and reply.startswith(ECHO_REQUEST):
                reply = pdu
            words = self._read(pdu, now) if reply is not None and not reply[0] & 0x80 else None
            return _reply(words or reply, took)
        if (words := self._read(pdu, now)) is not None:
            took, last = self._any.at(now)
            return None if last is None else _reply(words, took)
        return self._refuse(pdu)

    def _position(self) -> float | None:
        """Return the present time of the record, in s; None after its end."""
        now = self._clock()
        if self._begun is None:
            self._begun = now
        rounds, position = divmod(now - self._begun, self.length)
        if rounds > self._rounds:
            self._rounds = int(rounds)
            if self._repeats:
                self.report(f"The record of drive {self.address} begins again.")
            elif rounds == 1:
                self.report(f"The record of drive {self.address} has ended: it is silent now.")
        if rounds and not self._repeats:
            return None
        return position

    def _read(self, pdu: bytes, now: float) -> bytes | None:
        """Return the reply to a read whose words are all known, each as it was last; else None."""
        if pdu[0] not in GHOST_READS or len(pdu) != 5:
            return None
        tracks = [self._words.get((pdu[0], address)) for address in _addresses(pdu)]
        known = [track.at(now)[1] for track in tracks if track is not None]
        words = [word for word in known if word is not None]
        if not tracks or len(words) != len(tracks):
            return None
        data = _packed(words) if pdu[0] in GHOST_BITS else b"".join(words)
        return bytes([pdu[0], len(data)]) + data

    def _refuse(self, pdu: bytes) -> GhostReply | None:
        """Answer a request that the record does not have, and report it once."""
        code = self._refusal(pdu[0])
        if pdu not in self._unknown:
            self._unknown.add(pdu)
            how = "without a reply" if code is None else f"with exception {code}"
            self.report(f"Drive {self.address}: {_text(pdu)} is not in the record; answered {how}.")
        if code is None:
            return None
        return _reply(bytes([pdu[0] | 0x80, code]), self._any.at(0.0)[0])

    def _refusal(self, function: int) -> int | None:
        if function in GHOST_READS:
            silent = self._refusals.unknown_address is None or self.profile is None
            default = self._refusals.unknown_address
            return default if silent else self._unknown_read
        if function in GHOST_WRITES:
            return self._refusals.not_now
        return self._refusals.unknown_function

    @property
    def _unknown_read(self) -> int | None:
        assert self.profile is not None
        return self.profile.data.reading.unknown_exception


def _kind(pdu: bytes) -> bytes:
    """Return the part of a request by which it is found: an echo carries any data."""
    return ECHO_REQUEST if pdu.startswith(ECHO_REQUEST) else pdu


def _is_good_read(item: RecordedExchange) -> bool:
    request, reply = item.request, item.reply
    if request[0] not in GHOST_READS or reply is None or reply[0] != request[0]:
        return False
    count = len(_addresses(request))
    return len(reply) == 2 + ((count + 7) // 8 if request[0] in GHOST_BITS else 2 * count)


def _value(reply: bytes, place: int) -> bytes:
    """Return a word of a reply, or a bit as one byte."""
    if reply[0] in GHOST_BITS:
        return bytes([reply[2 + place // 8] >> place % 8 & 1])
    return reply[2 + 2 * place : 4 + 2 * place]


def _packed(bits: Sequence[bytes]) -> bytes:
    number = sum(bit[0] << place for place, bit in enumerate(bits))
    return number.to_bytes((len(bits) + 7) // 8, "little")


def _addresses(pdu: bytes) -> range:
    first = int.from_bytes(pdu[1:3], "big")
    return range(first, first + int.from_bytes(pdu[3:5], "big"))


def _reply(data: bytes | None, took: float) -> GhostReply | None:
    return None if data is None else GhostReply(data, took)


def _text(pdu: bytes) -> str:
    """Return a request as text."""
    if pdu[0] in GHOST_READS and len(pdu) == 5 and (addresses := _addresses(pdu)):
        if len(addresses) == 1:
            return f"the read of {addresses[0]}"
        return f"the read of {addresses[0]} to {addresses[-1]}"
    if pdu[0] in GHOST_WRITES and len(pdu) >= 3:
        return f"the write {pdu.hex(' ')} to {int.from_bytes(pdu[1:3], 'big')}"
    return f"the request {pdu.hex(' ')}"
