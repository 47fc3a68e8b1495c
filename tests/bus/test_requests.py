"""Requests: their bytes, their replies, and requests that are never sent."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tui.bus.coils import read_request, write_request
from tui.bus.errors import DeviceException, RequestRefused
from tui.bus.expectation import exception_code
from tui.bus.limits import CAUTIOUS, Limits, Window, send_refusal
from tui.bus.requests import (
    Diagnose,
    Identify,
    Objects,
    Read,
    ReadWrite,
    ReportId,
    Request,
    WriteMany,
    WriteOne,
    own_words_of,
    words_of,
)
from tui.wire.frames import frame

from .conftest import WIDE
from .peer import honest_pdu

# example frames of the drives' manuals
REQUESTS: list[tuple[Request, str]] = [
    (Read(2, 3102, 4), "02 03 0C 1E 00 04 27 6C"),
    (Read(1, 0x1875, 5), "01 03 18 75 00 05 92 B3"),
    (WriteOne(1, 0xFA01, 0x1770), "01 06 FA 01 17 70 E6 C6"),
    (WriteMany(2, 4043, (20, 30)), "02 10 0F CB 00 02 04 00 14 00 1E 30 F4"),
    (WriteMany(1, 0xFA01, (0x1770,)), "01 10 FA 01 00 01 02 17 70 F3 9A"),
    (Diagnose(4, 0, 0x3132), "04 08 00 00 31 32 74 1B"),
    (
        ReadWrite(2, 3102, 4, 9001, (20, 30)),
        "02 17 0C 1E 00 04 23 29 00 02 04 00 14 00 1E D2 F5",
    ),
    (Identify(2), "02 2B 0E 01 00 34 77"),
    (ReportId(1), "01 11 C0 2C"),
]


@pytest.mark.parametrize(
    ("request_", "register", "changes"),
    [
        (Read(2, 3102, 4), 3102, False),
        (WriteOne(1, 0xFA01, 0x1770), 0xFA01, True),
        (WriteMany(2, 4043, (20, 30)), 4043, True),
        (ReadWrite(2, 3102, 4, 9001, (20, 30)), 3102, True),
        (Diagnose(4, 0, 0x3132), 0, False),
        (Identify(2), 0, False),
        (ReportId(1), 0, False),
    ],
)
def test_request_has_first_register_and_effect(
    request_: Request, register: int, changes: bool
) -> None:
    assert (request_.register, request_.changes) == (register, changes)


@pytest.mark.parametrize(("request_", "text"), REQUESTS)
def test_request_is_encoded_as_bytes(request_: Request, text: str) -> None:
    assert frame(request_.device, request_.pdu()) == bytes.fromhex(text)


@pytest.mark.parametrize(
    "request_",
    [
        Read(1, 5, 3),
        WriteOne(1, 5, 7),
        WriteMany(1, 5, (7, 8)),
        ReadWrite(1, 5, 2, 9, (1, 2, 3)),
        Diagnose(1, 0, 0x1234),
        Identify(1),
        ReportId(1),
    ],
)
def test_right_reply_fits_and_every_shorter_or_longer_one_does_not(request_: Request) -> None:
    expectation, right = request_.expectation(), honest_pdu(request_.pdu())
    assert expectation.fits(right)
    for length in range(len(right)):
        assert not expectation.fits(right[:length])
    assert not expectation.fits(right + b"\0")
    for at, byte in enumerate(expectation.prefix):
        wrong = right[:at] + bytes([byte ^ 1]) + right[at + 1 :]
        assert not expectation.fits(wrong)
        assert expectation.mismatch(wrong)


def test_counter_of_function_8_answers_with_a_value() -> None:
    assert Diagnose(1, 0x0B, 0).expectation().fits(bytes([8, 0, 0x0B, 0x12, 0x34]))
    assert not Diagnose(1, 0x0B, 0).expectation().fits(bytes([8, 0, 0x0C, 0x12, 0x34]))
    assert not Diagnose(1, 0x0A, 0).expectation().fits(bytes([8, 0, 0x0A, 0x12, 0x34]))


@pytest.mark.parametrize(
    ("function", "pdu", "code"),
    [
        (3, [0x83, 2], 2),
        (3, [0x84, 2], None),
        (3, [0x83, 14, 2], None),
        (43, [0xAB, 1], 1),
        (43, [0xAB, 14, 1], 1),
        (43, [0xAB, 13, 1], None),
    ],
)
def test_exception_code_is_decoded(function: int, pdu: list[int], code: int | None) -> None:
    assert exception_code(function, bytes(pdu)) == code


def test_reply_is_decoded() -> None:
    assert words_of(bytes.fromhex("03 08 00 28 02 58 01 F4 00 00")) == (40, 600, 500, 0)
    pdu = bytes.fromhex(
        "2B 0E 01 02 00 00 03 00 0D 54 45 4C 45 4D 45 43 41 4E 49 51 55 45"
        "01 0F 41 54 56 33 31 48 55 30 39 4D 33 53 33 32 33 02 04 30 32 30 31"
    )
    assert Identify(2).expectation().fits(pdu)
    found = Objects().with_more(pdu)
    assert found.objects == {0: b"TELEMECANIQUE", 1: b"ATV31HU09M3S323", 2: b"0201"}
    assert found.conformity == 2
    assert found.next_object is None


def test_text_of_function_17_is_found_among_vendor_bytes() -> None:
    assert own_words_of(b"\x11\x0f\x02ATV71HU15M3\xff\0AB") == b"ATV71HU15M3"
    assert own_words_of(b"\x11\x02\x05\xff") == b"16#05FF"


REFUSED: list[tuple[Request, str]] = [
    (Read(-1, 5, 1), "does not exist"),
    (Read(256, 5, 1), "does not exist"),
    (Read(1, 5, 0), "0 words"),
    (Read(1, 5, -1), "-1 words"),
    (Read(1, 5, 126), "126 words"),
    (Read(1, -1, 1), "Register -1"),
    (Read(1, 65536, 1), "Register 65536"),
    (Read(1, 65535, 2), "after register 65535"),
    (WriteOne(1, 5, -1), "-1 does not fit"),
    (WriteOne(1, 5, 65536), "65536 does not fit"),
    (WriteMany(1, 5, ()), "0 words"),
    (WriteMany(1, 5, (1, 65536)), "65536 does not fit"),
    (WriteMany(1, 65535, (1, 2)), "after register 65535"),
    (ReadWrite(1, 5, 0, 9, (1,)), "0 words"),
    (ReadWrite(1, 5, 1, 9, ()), "0 words"),
    (Diagnose(1, 0, 65536), "65536 does not fit"),
    (Diagnose(1, 4, 0), "silence"),
    (Diagnose(1, 12, 0), "sub-function 12"),
    (Read(0, 5, 1), "cannot be broadcast"),
]


@pytest.mark.parametrize(("request_", "text"), REFUSED)
def test_impossible_request_is_refused(request_: Request, text: str) -> None:
    reason = send_refusal(request_, WIDE)
    assert text in reason
    assert reason.endswith(".")


LEROY_SOMER = replace(WIDE, max_read=20, max_write=20, functions=frozenset({3, 16}))
ATV21 = Limits(
    functions=frozenset({3, 6, 16, 43}),
    max_read=1,
    max_write=1,
    max_read_23=0,
    max_write_23=0,
    single_words_only=True,
    read_windows=(Window(0x1875, 2, 5, fixed_start=True),),
    write_windows=(Window(0x1870, 2, 2, fixed_start=True),),
)
SCANNER = replace(ATV21, read_windows=(Window(100, 1, 8, fixed_start=False),))


@pytest.mark.parametrize(
    ("request_", "limits", "allowed"),
    [
        (Read(1, 5, 20), LEROY_SOMER, True),
        (Read(1, 5, 21), LEROY_SOMER, False),
        (WriteMany(1, 5, (0,) * 20), LEROY_SOMER, True),
        (WriteMany(1, 5, (0,) * 21), LEROY_SOMER, False),
        (WriteOne(1, 5, 0), LEROY_SOMER, False),
        (Identify(1), LEROY_SOMER, False),
        (Read(1, 0xFD00, 1), ATV21, True),
        (Read(1, 0xFD00, 2), ATV21, False),
        (Read(1, 0x1875, 5), ATV21, True),
        (Read(1, 0x1875, 2), ATV21, True),
        (Read(1, 0x1875, 6), ATV21, False),
        (Read(1, 0x1876, 2), ATV21, False),
        (WriteMany(1, 0xFA00, (1,)), ATV21, True),
        (WriteMany(1, 0x1870, (1, 2)), ATV21, True),
        (WriteMany(1, 0x1871, (1, 2)), ATV21, False),
        (WriteMany(1, 0x1870, (1, 2, 3)), ATV21, False),
        (ReadWrite(1, 5, 1, 9, (1,)), ATV21, False),
        (Read(1, 102, 6), SCANNER, True),
        (Read(1, 102, 7), SCANNER, False),
        (Read(1, 99, 2), SCANNER, False),
        (Read(1, 5, 1), CAUTIOUS, True),
        (Read(1, 5, 2), CAUTIOUS, False),
        (Identify(1), CAUTIOUS, True),
        (ReportId(1), CAUTIOUS, True),
        (WriteOne(1, 5, 1), CAUTIOUS, False),
        (Diagnose(1, 0, 0), CAUTIOUS, False),
        (WriteOne(0, 5, 1), WIDE, True),
        (WriteOne(0, 5, 1), ATV21, False),
        (Diagnose(0, 0, 1), WIDE, False),
    ],
)
def test_request_beyond_the_limits_of_a_device_is_refused(
    request_: Request, limits: Limits, allowed: bool
) -> None:
    assert (send_refusal(request_, limits) == "") is allowed


@pytest.mark.parametrize(
    ("request_", "allowed"),
    [
        (Read(1, 5, 1), True),
        (Identify(1), True),
        (Diagnose(1, 0, 1), True),
        (Diagnose(1, 11, 0), True),
        (Diagnose(1, 10, 0), False),
        (WriteOne(1, 5, 1), False),
        (WriteMany(1, 5, (1,)), False),
        (ReadWrite(1, 5, 1, 9, (1,)), False),
        (WriteOne(0, 5, 1), False),
    ],
)
def test_read_only_allows_requests_that_change_nothing(request_: Request, allowed: bool) -> None:
    assert (send_refusal(request_, WIDE, read_only=True) == "") is allowed


def test_refusal_ends_with_one_period() -> None:
    refusal = DeviceException(1, 6, 64001, 3, "Value not allowed: it is out of range.")
    assert str(refusal).endswith("out of range.")
    assert not str(refusal).endswith("..")


@pytest.mark.parametrize(
    ("count", "multiple", "functions", "sent_by"),
    [
        (1, None, {3, 6, 16}, 6),
        (1, None, {3, 6}, 6),
        (1, None, {3, 16}, 16),
        (1, None, {3}, 6),
        (2, None, {3, 6, 16}, 16),
        (2, None, {3, 6}, 16),
        (1, True, {3, 6}, 16),
        (1, False, {3, 16}, 6),
        (2, True, {3, 6}, 16),
    ],
)
def test_write_uses_a_function_of_the_device(
    count: int, multiple: bool | None, functions: set[int], sent_by: int
) -> None:
    request = write_request(4, 100, range(1, count + 1), multiple, frozenset(functions))
    values = b"".join(value.to_bytes(2) for value in range(1, count + 1))
    head = bytes([sent_by, 0, 100]) + bytes([0, count, 2 * count] if sent_by == 16 else [])
    assert (request.device, request.pdu()) == (4, head + values)


@pytest.mark.parametrize("count", [0, 2, 3])
def test_function_6_carries_one_word_only(count: int) -> None:
    with pytest.raises(RequestRefused, match=f"one word, not {count}"):
        write_request(1, 100, [5] * count, False, frozenset({3, 6, 16}))


@pytest.mark.parametrize("function", [3, 4])
def test_words_are_read_by_the_function_of_their_kind(function: int) -> None:
    request = read_request(4, 100, 2, function)
    assert (request.device, request.pdu()) == (4, bytes([function, 0, 100, 0, 2]))
    assert request.function == function
