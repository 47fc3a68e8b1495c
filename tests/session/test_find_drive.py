"""Whether anybody is at an address, and then who: by the fewest requests."""

from __future__ import annotations

import pytest

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.bus.fake import FakeLine
from tui.bus.requests import Identify, Read, ReportId
from tui.drive.finding import PresenceProbe
from tui.session.connect.identify import ScanResult, find_drive

STATUS = 1039
PROBES = (PresenceProbe(STATUS, ("powerdrive", "varmeca")),)


async def found(line: FakeLine, probes: tuple[PresenceProbe, ...] = PROBES) -> ScanResult:
    return await find_drive(
        line, 1, probes, priority=Priority.BACKGROUND, within=0.01, patience=0.02
    )


async def test_nobody_is_asked_by_one_read() -> None:
    line = FakeLine()
    with pytest.raises(NoAnswer):
        await found(line)
    assert line.requests == [Read(1, STATUS, 1)]


async def test_who_refuses_the_read_says_who_it_is() -> None:
    line = FakeLine({1: {}})
    line.devices[1].identity = {0: b"Telemecanique", 1: b"ATV71HU15M3", 2: b"0201", 6: b"FAN"}
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.identity.name, result.by) == (
        "atv71",
        "FAN",
        "function 43",
    )
    assert line.requests == [Read(1, STATUS, 1), Identify(1)]


async def test_who_has_no_function_43_is_asked_by_17() -> None:
    line = FakeLine({1: {}})
    line.devices[1].called = b"ATV312HU09M3"
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.by) == ("atv312", "function 17")
    assert line.requests == [Read(1, STATUS, 1), Identify(1), ReportId(1)]


async def test_who_tells_its_state_and_nothing_else_is_likely() -> None:
    line = FakeLine({1: {STATUS: 0}})
    line.fail_identify(1, NoAnswer(1, 43, 0))
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.identity.candidates) == (
        None,
        ("powerdrive", "varmeca"),
    )
    assert result.by == f"read of register {STATUS}"
    # the last word of it is an answer: it counts as there
    assert line.requests[-1] == Read(1, STATUS, 1)
    assert line.device_state(1).answers


async def test_who_only_refuses_is_there_and_unknown() -> None:
    result = await found(FakeLine({1: {}}))
    assert result.identity is not None
    assert (result.identity.candidates, result.by) == ((), "")


async def test_families_at_several_words_are_asked_one_after_the_other() -> None:
    line = FakeLine({1: {7: 0}})
    line.fail_identify(1, 1)
    result = await found(line, (*PROBES, PresenceProbe(7, ("mine",))))
    assert result.identity is not None
    assert result.identity.candidates == ("mine",)


async def test_where_nothing_is_sure_to_be_refused_function_43_finds_it() -> None:
    line = FakeLine({1: {}})
    line.devices[1].identity = {1: b"ATV71HU15M3"}
    line.fail_read(1, None, NoAnswer(1, 3, STATUS))
    result = await found(line, (*PROBES, PresenceProbe(None)))
    assert result.by == "function 43"
    assert line.requests.count(Identify(1)) == 1
