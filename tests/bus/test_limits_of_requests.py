"""Each bound of a request: the last value that is sent, and the first one that is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import pytest

from tui.bus.limits import CAUTIOUS, STANDARD_EXCEPTIONS, Limits, Window, send_refusal
from tui.bus.requests import (
    Diagnose,
    Identify,
    Read,
    ReadInput,
    ReadWrite,
    ReportId,
    Request,
    WriteMany,
    WriteOne,
)

from .conftest import WIDE

ALL = replace(
    WIDE,
    functions=WIDE.functions | {4, 17},
    max_read=1000,
    max_read_4=1000,
    max_write=1000,
    max_read_23=1000,
    max_write_23=1000,
    subfunctions=frozenset({0, 65535}),
    broadcast_functions=frozenset({6, 16}),
)
"""A device that would take more than Modbus allows."""
Made = Callable[[int], Request]


def words(count: int) -> tuple[int, ...]:
    return (7,) * count


BOUNDS: dict[str, tuple[Made, int, int]] = {
    "device": (lambda n: WriteOne(n, 5, 1), 0, 255),
    "address read": (lambda n: Read(1, n, 1), 0, 65535),
    "address read by function 4": (lambda n: ReadInput(1, n, 1), 0, 65535),
    "address of one word": (lambda n: WriteOne(1, n, 1), 0, 65535),
    "address of several": (lambda n: WriteMany(1, n, (1,)), 0, 65535),
    "address read by function 23": (lambda n: ReadWrite(1, n, 1, 9, (1,)), 0, 65535),
    "address written by function 23": (lambda n: ReadWrite(1, 9, 1, n, (1,)), 0, 65535),
    "last register read": (lambda n: Read(1, n, 10), 0, 65526),
    "last register written": (lambda n: WriteMany(1, n, words(10)), 0, 65526),
    "words read": (lambda n: Read(1, 5, n), 1, 125),
    "words read by function 4": (lambda n: ReadInput(1, 5, n), 1, 125),
    "words written": (lambda n: WriteMany(1, 5, words(n)), 1, 123),
    "words read by function 23": (lambda n: ReadWrite(1, 5, n, 9, (1,)), 1, 125),
    "words written by function 23": (lambda n: ReadWrite(1, 5, 1, 9, words(n)), 1, 121),
    "value of one word": (lambda n: WriteOne(1, 5, n), 0, 65535),
    "value of several": (lambda n: WriteMany(1, 5, (1, n)), 0, 65535),
    "value of function 23": (lambda n: ReadWrite(1, 5, 1, 9, (1, n)), 0, 65535),
    "value of function 8": (lambda n: Diagnose(1, 0, n), 0, 65535),
}


@pytest.mark.parametrize("bound", BOUNDS)
def test_modbus_allows_a_request_up_to_both_ends_of_a_bound(bound: str) -> None:
    made, low, high = BOUNDS[bound]
    for inside in (low, high):
        assert send_refusal(made(inside), ALL) == ""
    for outside in (low - 1, high + 1):
        assert send_refusal(made(outside), ALL).endswith(".")


OWN: dict[str, tuple[str, Made]] = {
    "function 3": ("max_read", lambda n: Read(1, 5, n)),
    "function 4": ("max_read_4", lambda n: ReadInput(1, 5, n)),
    "function 16": ("max_write", lambda n: WriteMany(1, 5, words(n))),
    "function 23, read": ("max_read_23", lambda n: ReadWrite(1, 5, n, 9, (1,))),
    "function 23, written": ("max_write_23", lambda n: ReadWrite(1, 5, 1, 9, words(n))),
}


@pytest.mark.parametrize("most", [1, 2, 29])
@pytest.mark.parametrize("function", OWN)
def test_device_is_sent_as_many_words_as_it_takes(function: str, most: int) -> None:
    field, made = OWN[function]
    limits = replace(ALL, **{field: most})  # type: ignore[arg-type]
    assert send_refusal(made(most), limits) == ""
    refusal = send_refusal(made(most + 1), limits)
    assert str(most) in refusal
    assert ("read" if "read" in field else "writ") in refusal
    assert refusal.endswith(".")


def test_input_registers_are_read_one_by_one_unless_more_is_known() -> None:
    limits = Limits(frozenset({4}), 20, 20, 20, 20)
    assert send_refusal(ReadInput(1, 5, 1), limits) == ""
    assert send_refusal(ReadInput(1, 5, 2), limits)


@pytest.mark.parametrize("broadcast", [{6}, {16}, {6, 16}, set()])
def test_broadcast_is_sent_by_its_functions_only(broadcast: set[int]) -> None:
    limits = replace(ALL, broadcast_functions=frozenset(broadcast))
    for request in (WriteOne(0, 5, 1), WriteMany(0, 5, (1, 2))):
        refusal = send_refusal(request, limits)
        assert (refusal == "") is (request.function in broadcast)


@pytest.mark.parametrize("subfunction", [0, 1, 2, 4, 11, 65535])
def test_sub_function_that_a_device_lacks_is_not_sent(subfunction: int) -> None:
    allowed = send_refusal(Diagnose(1, subfunction, 0), ALL) == ""
    assert allowed is (subfunction in (0, 65535))
    listen_only = send_refusal(Diagnose(1, 4, 0), replace(ALL, subfunctions=frozenset({4})))
    assert "silence" in listen_only


CHANGING = [
    WriteOne(1, 5, 1),
    WriteMany(1, 5, (1,)),
    ReadWrite(1, 5, 1, 9, (1,)),
    Diagnose(1, 1, 0),
]
HARMLESS = [Read(1, 5, 1), ReadInput(1, 5, 1), Identify(1), ReportId(1), Diagnose(1, 0, 0)]


@pytest.mark.parametrize("request_", CHANGING)
def test_write_is_refused_with_the_reason_for_which_writes_are_held(request_: Request) -> None:
    assert send_refusal(request_, ALL, held="The drive is another one.") == (
        "The drive is another one."
    )
    assert "read-only" in send_refusal(request_, ALL, read_only=True, held="Another.")


@pytest.mark.parametrize("request_", HARMLESS)
def test_read_is_sent_while_writes_are_held(request_: Request) -> None:
    assert send_refusal(request_, ALL, read_only=True, held="Another.") == ""


def test_unknown_device_is_read_word_by_word_and_identified() -> None:
    sent = [r for r in (*CHANGING, *HARMLESS, Read(1, 5, 2)) if not send_refusal(r, CAUTIOUS)]
    assert sent == [Read(1, 5, 1), Identify(1), ReportId(1)]


@pytest.mark.parametrize("fixed", [True, False])
def test_window_holds_the_blocks_whose_registers_are_all_in_it(fixed: bool) -> None:
    window = Window(100, 2, 4, fixed_start=fixed)
    inside = range(100, 104)
    for address, count in product(range(97, 107), range(7)):
        block = range(address, address + count)
        holds = 2 <= count <= 4 and all(register in inside for register in block)
        assert window.holds(address, count) is (holds and (address == 100 or not fixed))


@pytest.mark.parametrize("read", [True, False])
def test_device_of_single_words_is_sent_blocks_in_its_windows_only(read: bool) -> None:
    windows = (Window(100, 2, 4, fixed_start=False), Window(200, 3, 3, fixed_start=True))
    fields = {"read_windows" if read else "write_windows": windows, "single_words_only": True}
    limits = replace(ALL, **fields)  # type: ignore[arg-type]
    for address, count in product((100, 101, 103, 200, 201, 300), range(1, 6)):
        request = Read(1, address, count) if read else WriteMany(1, address, words(count))
        held = any(window.holds(address, count) for window in windows)
        assert (send_refusal(request, limits) == "") is (count == 1 or held)


def test_exceptions_have_the_meanings_of_the_specification() -> None:
    """Section 7 of the Modbus Application Protocol V1.1b3; 7 is of its older editions."""
    words_of = {
        1: "function", 2: "address", 3: "value", 4: "cannot", 5: "time", 6: "busy",
        7: "refuses", 8: "memory", 10: "no path", 11: "did not answer",
    }  # fmt: skip
    assert set(STANDARD_EXCEPTIONS) == set(words_of)
    for code, word in words_of.items():
        assert word in STANDARD_EXCEPTIONS[code]
        assert not STANDARD_EXCEPTIONS[code].endswith(".")
