"""The parts of a frame: device, function, data; as RTU or as Modbus TCP."""

from __future__ import annotations

from dataclasses import dataclass

MBAP_BYTES = 7
"""Bytes before the function code on Modbus TCP."""
SHORTEST_PDU = 2


@dataclass(frozen=True, slots=True)
class Pdu:
    """Device, function and its data."""

    device: int
    function: int
    body: bytes


def pdu_of(data: bytes, *, tcp: bool) -> Pdu | None:
    """The parts of a frame; None of bytes that form none."""
    if tcp:
        return Pdu(data[6], data[7], data[8:]) if len(data) > MBAP_BYTES else None
    return Pdu(data[0], data[1], data[2:-2]) if len(data) >= SHORTEST_PDU + 2 else None
