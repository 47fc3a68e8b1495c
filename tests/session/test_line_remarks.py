"""Remarks on a line, from its frames, during a search."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.link import Link, RtuTcpLink, TcpLink
from tui.session.diagnosis.gateway_probe import GATEWAY_CODES
from tui.session.diagnosis.remarks import LineRemarks

RTU, TCP = RtuTcpLink("h", 1), TcpLink("h", 1)


def frame(
    time: float, data: list[int], note: str = "", direction: str = "in", head: int = 0
) -> SimpleNamespace:
    whole = bytes(head) + bytes(data)
    return SimpleNamespace(time=time, data=whole, note=note, direction=direction)


def remarks_on(link: Link, *earlier: SimpleNamespace) -> tuple[Any, LineRemarks]:
    line = SimpleNamespace(link=link, trace=list(earlier))
    return line, LineRemarks(cast(Any, line))


def test_good_line_has_no_remarks() -> None:
    line, remarks = remarks_on(RTU)
    remarks.look()
    line.trace.append(frame(1.0, [1, 3, 2, 0, 7, 0, 0]))
    remarks.look()
    assert remarks.texts == []


@pytest.mark.parametrize(("link", "head"), [(RTU, 0), (TCP, 6)])
def test_addresses_that_a_gateway_did_not_reach_are_listed_by_its_code(
    link: Link, head: int
) -> None:
    line, remarks = remarks_on(link, frame(0.5, [9, 0x83, 11], head=head))
    line.trace += [
        frame(1.0, [7, 0x83, 11], head=head), frame(1.1, [5, 0x83, 11], head=head),
        frame(1.2, [8, 0x83, 10], head=head), frame(1.3, [4, 0x83, 2], head=head),
        frame(1.4, [3, 3, 11], head=head), frame(1.5, [2, 0x83, 11], direction="out", head=head),
        frame(1.6, [6, 0x83], head=head),
    ]  # fmt: skip
    remarks.look()
    remarks.look()
    assert remarks.texts == [
        f"The gateway answers {GATEWAY_CODES[10]}: address 8.",
        f"The gateway answers {GATEWAY_CODES[11]}: address 5,7.",
    ]


def test_echoes_are_counted_once_each() -> None:
    line, remarks = remarks_on(RTU, frame(0.5, [1], note="echo"))
    line.trace += [frame(1.0, [1], note="echo"), frame(1.1, [1], note="echo of it")]
    remarks.look()
    line.trace.append(frame(1.2, [1], note="no echo"))
    remarks.look()
    assert remarks.texts == ["The adapter repeats what it sends: 2 requests came back as an echo."]
