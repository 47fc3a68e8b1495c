"""Remarks for a person beside the bytes of one exchange: a pure function."""

from __future__ import annotations

from collections.abc import Iterator

from ..result import ExchangeResult, ResultKind
from .frames import pieces


def noted(result: ExchangeResult, request: bytes, device: int) -> Iterator[tuple[bytes, str]]:
    """Yield the received pieces, each with its remark; empty for the reply itself."""
    if not result.received:
        return
    if result.pdu and len(result.received) == len(result.pdu) + 3:
        yield result.received, ""
        return
    for piece in pieces(result.received):
        if piece.data == request and piece.pdu != result.pdu:
            note = "echo or answer" if result.kind is ResultKind.UNSURE else "echo"
        elif not piece.whole:
            note = "damaged" if result.kind is ResultKind.DAMAGED else "noise"
        elif piece.device != device:
            note = f"of device {piece.device}"
        else:
            note = "" if piece.pdu == result.pdu else "not the reply"
        yield piece.data, note
