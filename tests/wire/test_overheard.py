"""Frames of another master are distinguished from replies."""

from __future__ import annotations

import pytest

from tui.wire.frames import frame, read_frame, read_write_frame, write_frame
from tui.wire.overheard import overheard_request


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (read_frame(4, 3201, 8), "read of registers 3201 to 3208"),
        (read_frame(4, 0x03AB, 1), "read of register 939"),
        (frame(4, bytes.fromhex("04 0005 0001")), "read of input register 5"),
        (frame(4, bytes.fromhex("06 2135 0006")), "write of register 8501"),
        (write_frame(4, 8501, [6, 30]), "write of registers 8501 to 8502"),
        (read_write_frame(4, 3201, 2, 8501, [6]), "function 23"),
        (frame(4, bytes.fromhex("2B 0E 01 00")), "its identity (function 43)"),
        (frame(4, bytes([17])), "its identity (function 17)"),
    ],
)
def test_requests_are_described(data: bytes, text: str) -> None:
    request = overheard_request(data)
    assert request is not None
    assert (request.device, request.text) == (4, text)


@pytest.mark.parametrize(
    "pdu",
    [
        "03 02 0006",
        "03 04 0006 0007",
        "10 2135 0002",
        "83 02",
        "11 03 41 42 FF",
        "2B 0E 01 01 00 00 00",
    ],
)
def test_replies_are_not_requests(pdu: str) -> None:
    assert overheard_request(frame(4, bytes.fromhex(pdu))) is None
