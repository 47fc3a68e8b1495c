"""Modbus functions of a simulated server: request in, reply or None out."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol

from tui.drive.profile.schema import Function, Identification

from ..rules import Refusals
from .access import Refused, past_limit

IDENTIFICATION_TYPE = 14
COUNTER_RESET, CHECKSUM_COUNT, FRAME_COUNT, ECHO = 10, 12, 14, 0
NAME_LENGTH = 16
REFERENCE_OBJECT, SERVER_ID, RUNS = 1, 1, 0xFF
_OFF, _ON = bytes([0, 0]), bytes([0xFF, 0])


class Words(Protocol):
    """Words that a server reads and writes."""

    def read(self, address: int, count: int, function: Function, /) -> list[int]:
        """Read words from an address; raises Refused."""

    def write(self, address: int, words: Sequence[int], function: Function, /) -> None:
        """Write words at an address; raises Refused."""


@dataclass
class DiagnosticCounters:
    """Counters of function 8: frames to the drive's own address, good and damaged.

    Source: ATV71 Modbus manual, Modbus counters.
    """

    frames: int = 0
    checksum_errors: int = 0

    def count_frame(self) -> None:
        """Count a frame, modulo 65536."""
        self.frames = (self.frames + 1) & 0xFFFF

    def count_checksum_error(self) -> None:
        """Count a frame with a wrong checksum; that count stays at 65535."""
        self.count_frame()
        self.checksum_errors = min(self.checksum_errors + 1, 0xFFFF)

    def reset(self) -> None:
        """Set all counters to 0."""
        self.frames = self.checksum_errors = 0


@dataclass
class Server:
    """Modbus server: its words, functions, identity and counters."""

    words: Words
    functions: Mapping[int, Function]
    refusals: Refusals
    identification: Identification = field(default_factory=Identification)
    identity: Mapping[int, bytes] = field(default_factory=dict)
    counters: DiagnosticCounters = field(default_factory=DiagnosticCounters)

    def answer(self, pdu: bytes) -> bytes | None:
        """Return the reply to a request without address and checksum; None for no reply."""
        if not pdu:
            return None
        function = self.functions.get(pdu[0])
        handler = _HANDLERS.get(pdu[0])
        try:
            if function is None or handler is None:
                raise Refused(self.refusals.unknown_function)
            return bytes([pdu[0]]) + handler(self, function, pdu[1:])
        except Refused as refusal:
            return self._refuse(pdu[0], refusal.code)

    def _refuse(self, function: int, code: int | None) -> bytes | None:
        if code is None:
            return None
        head = bytes([function | 0x80])
        if function == 43 and self.identification.exception_has_mei_byte:
            head += bytes([IDENTIFICATION_TYPE])
        return head + bytes([code])


def _wrong_shape(server: Server) -> Refused:
    return Refused(server.refusals.wrong_shape)


def _packed(words: Sequence[int]) -> bytes:
    return bytes([2 * len(words)]) + struct.pack(f">{len(words)}H", *words)


def _read(server: Server, function: Function, body: bytes) -> bytes:
    if len(body) != 4:
        raise _wrong_shape(server)
    address, count = struct.unpack(">HH", body)
    return _packed(server.words.read(address, count, function))


def _read_bits(server: Server, function: Function, body: bytes) -> bytes:
    if len(body) != 4:
        raise _wrong_shape(server)
    address, count = struct.unpack(">HH", body)
    bits = server.words.read(address, count, function)
    data = bytearray((count + 7) // 8)
    for place, bit in enumerate(bits):
        data[place // 8] |= bit << place % 8
    return bytes([len(data)]) + data


def _write_coil(server: Server, function: Function, body: bytes) -> bytes:
    if len(body) != 4 or body[2:] not in (_OFF, _ON):
        raise _wrong_shape(server)
    server.words.write(int.from_bytes(body[:2], "big"), [int(body[2:] == _ON)], function)
    return body


def _write_coils(server: Server, function: Function, body: bytes) -> bytes:
    if len(body) < 5:
        raise _wrong_shape(server)
    address, count, size = struct.unpack(">HHB", body[:5])
    if not count or size != (count + 7) // 8 or len(body) - 5 != size:
        raise _wrong_shape(server)
    bits = [body[5 + place // 8] >> place % 8 & 1 for place in range(count)]
    server.words.write(address, bits, function)
    return body[:4]


def _write_one(server: Server, function: Function, body: bytes) -> bytes:
    if len(body) != 4:
        raise _wrong_shape(server)
    address, word = struct.unpack(">HH", body)
    server.words.write(address, [word], function)
    return body


def _write_many(server: Server, function: Function, body: bytes) -> bytes:
    address, words = _written_words(server, body, function)
    server.words.write(address, words, function)
    return body[:4]


def _written_words(server: Server, body: bytes, function: Function) -> tuple[int, list[int]]:
    """Return address and words of a write; a count above the limit is checked before its bytes."""
    if len(body) < 5:
        raise _wrong_shape(server)
    address, count, size = struct.unpack(">HHB", body[:5])
    if function.max_write is not None and count > function.max_write:
        raise Refused(past_limit(function, server.refusals.wrong_shape))
    if size != 2 * count or len(body) - 5 != size:
        raise _wrong_shape(server)
    return address, list(struct.unpack(f">{count}H", body[5:]))


def _read_write(server: Server, function: Function, body: bytes) -> bytes:
    """Execute function 23: the write precedes the read, as the Modbus specification says."""
    if len(body) < 9:
        raise _wrong_shape(server)
    address, count = struct.unpack(">HH", body[:4])
    if function.max_read is not None and count > function.max_read:
        raise Refused(past_limit(function, server.refusals.wrong_shape))
    write_address, words = _written_words(server, body[4:], function)
    server.words.write(write_address, words, function)
    return _packed(server.words.read(address, count, function))


def _diagnose(server: Server, function: Function, body: bytes) -> bytes:
    if len(body) < 4:
        raise _wrong_shape(server)
    code = int.from_bytes(body[:2], "big")
    if function.subfunctions and code not in function.subfunctions:
        raise Refused(server.refusals.unknown_function)
    if code == ECHO:
        return body
    if body[2:] != b"\0\0":
        raise _wrong_shape(server)
    if code == COUNTER_RESET:
        server.counters.reset()
        return body
    counts = {CHECKSUM_COUNT: "checksum_errors", FRAME_COUNT: "frames"}
    if code not in counts:
        raise Refused(server.refusals.unknown_function)
    return body[:2] + struct.pack(">H", getattr(server.counters, counts[code]))


def _identify(server: Server, function: Function, body: bytes) -> bytes:
    """Execute function 43/14; the ATV21 has its own codes for a wrong field, the others 1 and 2."""
    own_codes = not server.identification.exception_has_mei_byte
    if len(body) != 3 or body[0] != IDENTIFICATION_TYPE:
        raise Refused(1)
    _, read_id, first = body
    if not 1 <= read_id <= server.identification.highest_read_device_id:
        raise Refused(3 if own_codes else 1)
    single = read_id == 4
    if first not in server.identity if single else first != 0:
        raise Refused(3 if own_codes else 2)
    chosen = {first: server.identity[first]} if single else server.identity
    objects = b"".join(bytes([i, len(text)]) + text for i, text in sorted(chosen.items()))
    head = bytes([IDENTIFICATION_TYPE, read_id, server.identification.conformity, 0, 0])
    return head + bytes([len(chosen)]) + objects


def _report_id(server: Server, function: Function, body: bytes) -> bytes:
    """Execute function 17: an id, the sign that it runs, and the reference as text.

    A reference such as 16#2AFF is all bytes of the reply.
    """
    if body or not (text := server.identity.get(REFERENCE_OBJECT, b"")):
        raise _wrong_shape(server)
    if text.startswith(b"16#"):
        with suppress(ValueError):
            data = bytes.fromhex(text[3:].decode())
            return bytes([len(data)]) + data
    return bytes([2 + len(text), SERVER_ID, RUNS]) + text


_HANDLERS: Mapping[int, Callable[[Server, Function, bytes], bytes]] = {
    1: _read_bits,
    2: _read_bits,
    3: _read,
    4: _read,
    5: _write_coil,
    6: _write_one,
    8: _diagnose,
    15: _write_coils,
    16: _write_many,
    17: _report_id,
    23: _read_write,
    43: _identify,
}


def identity_of(
    identification: Identification, name: str, replaced: Mapping[int, str]
) -> dict[int, bytes]:
    """Return a drive's identification objects: the profile's examples, its name, and
    replacements."""
    objects = {o.id: o.example for o in identification.objects if o.example}
    for item in identification.objects:
        if name and item.meaning == "name":
            objects[item.id] = name[:NAME_LENGTH]
    objects.update(replaced)
    return {i: text.encode("ascii", "replace") for i, text in objects.items()}
