"""Detection of a drive at an address with minimal requests, then its identification."""

from __future__ import annotations

from typing import Any

import pytest

from tui.bus.api import (
    DeviceCounters,
    IdentificationObjects,
    LastMinute,
    LineCounters,
    Priority,
    Reply,
)
from tui.bus.errors import ChecksumFault, ExchangeError, NoAnswer, WrongReply
from tui.bus.fake import FakeLine
from tui.bus.requests import Identify, Read, ReportId
from tui.drive.finding import PresenceProbe
from tui.session.connect.identify import ScanResult, find_drive, identify_drive

STATUS = 1039
PROBES = (PresenceProbe(STATUS, ("powerdrive", "varmeca")),)


async def found(line: FakeLine, probes: tuple[PresenceProbe, ...] = PROBES) -> ScanResult:
    return await find_drive(
        line, 1, probes, priority=Priority.BACKGROUND, within=0.01, patience=0.02
    )


async def test_silent_address_costs_one_read() -> None:
    line = FakeLine()
    with pytest.raises(NoAnswer):
        await found(line)
    assert line.requests == [Read(1, STATUS, 1)]


async def test_refusal_of_a_read_identifies_the_drive() -> None:
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


async def test_drive_without_function_43_is_identified_by_17() -> None:
    line = FakeLine({1: {}})
    line.devices[1].called = b"ATV312HU09M3"
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.by) == ("atv312", "function 17")
    assert line.requests == [Read(1, STATUS, 1), Identify(1), ReportId(1)]


async def test_drive_that_only_reports_its_state_is_likely() -> None:
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


async def test_drive_that_only_refuses_is_present_and_unknown() -> None:
    result = await found(FakeLine({1: {}}))
    assert result.identity is not None
    assert (result.identity.candidates, result.by) == ((), "")


async def test_families_with_different_probes_are_probed_in_turn() -> None:
    line = FakeLine({1: {7: 0}})
    line.fail_identify(1, 1)
    result = await found(line, (*PROBES, PresenceProbe(7, ("mine",))))
    assert result.identity is not None
    assert result.identity.candidates == ("mine",)


async def test_function_43_finds_a_drive_that_refuses_no_probe() -> None:
    line = FakeLine({1: {}})
    line.devices[1].identity = {1: b"ATV71HU15M3"}
    line.fail_read(1, None, NoAnswer(1, 3, STATUS))
    result = await found(line, (*PROBES, PresenceProbe(None)))
    assert result.by == "function 43"
    assert line.requests.count(Identify(1)) == 1


ATV71 = {0: b"Telemecanique", 1: b"ATV71HU15M3", 2: b"0201"}
"""An Altivar that answers the read by which Leroy-Somer drives are found, as some gateways do."""
LOST, DAMAGED, TWOFOLD = NoAnswer(1, 43, 0), ChecksumFault(1, 43, 0), WrongReply(1, 43, 0)


def altivar_with_every_word() -> FakeLine:
    line = FakeLine({1: {STATUS: 0}})
    line.devices[1].identity = ATV71
    return line


@pytest.mark.parametrize("error", [LOST, DAMAGED, TWOFOLD])
@pytest.mark.parametrize("times", [1, 2])
async def test_lost_identification_is_requested_again(error: ExchangeError, times: int) -> None:
    line = altivar_with_every_word()
    line.fail_identify(1, error, times=times)
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.error) == ("atv71", "")


@pytest.mark.parametrize("error", [DAMAGED, TWOFOLD])
async def test_identification_that_stays_damaged_infers_no_family(error: ExchangeError) -> None:
    line = altivar_with_every_word()
    line.fail_identify(1, error)
    result = await found(line)
    assert result.identity is not None
    assert (result.identity.profile, result.identity.candidates) == (None, ())
    assert result.error == str(error)
    assert line.requests.count(Identify(1)) == 3


class LosesReads(FakeLine):
    """A line that loses the second reply, and delivers the others."""

    async def read(self, device: int, address: int, *some: int, **how: Any) -> Reply:
        reply = await super().read(device, address, *some, **how)
        if sum(isinstance(request, Read) for request in self.requests) == 2:
            raise NoAnswer(device, 3, address)
        return reply


async def test_silence_beside_a_lost_read_infers_no_family() -> None:
    line = LosesReads({1: {STATUS: 0}})
    line.fail_identify(1, LOST)
    result = await found(line)
    assert result.identity is not None
    assert result.identity.candidates == ()
    assert "No identification of device 1 came through" in result.error


class DamagedThenSilent(FakeLine):
    """A line that damages the first identification, and loses all that follow."""

    async def identify(self, device: int, **_: Any) -> IdentificationObjects:
        self.requests.append(Identify(device))
        raise DAMAGED if self.requests.count(Identify(device)) == 1 else LOST


class Damaging(FakeLine):
    """A line on which damaged frames of any device are counted at each identification."""

    async def identify(self, device: int, **how: Any) -> IdentificationObjects:
        self.counters = LineCounters(checksum=self.counters.checksum + 1)
        return await super().identify(device, **how)


async def test_silence_on_a_damaging_line_infers_no_family() -> None:
    line = Damaging({1: {STATUS: 0}})
    line.fail_identify(1, LOST)
    result = await found(line)
    assert result.identity is not None
    assert result.identity.candidates == ()
    assert "No identification of device 1 came through" in result.error


async def test_damaged_reply_to_the_first_read_shows_a_drive() -> None:
    line = altivar_with_every_word()
    line.fail_read(1, STATUS, ChecksumFault(1, 3, STATUS))
    result = await found(line)
    assert result.identity is not None
    assert result.identity.profile == "atv71"


@pytest.mark.parametrize("error", [DAMAGED, TWOFOLD])
async def test_identification_of_one_drive_fails_after_three_damaged_replies(
    error: ExchangeError,
) -> None:
    line = altivar_with_every_word()
    line.fail_identify(1, error)
    with pytest.raises(ExchangeError):
        await identify_drive(line, 1)
    assert line.requests.count(Identify(1)) == 3
    line = altivar_with_every_word()
    line.fail_identify(1, error, times=2)
    assert (await identify_drive(line, 1)).profile == "atv71"


async def test_family_without_function_43_has_likely_candidates() -> None:
    line = FakeLine({1: {STATUS: 0}})
    line.fail_identify(1, LOST)
    assert set((await identify_drive(line, 1)).candidates) >= {"powerdrive", "varmeca"}


async def test_silence_after_damage_identifies_nothing() -> None:
    line = DamagedThenSilent({1: {STATUS: 0}})
    with pytest.raises(ChecksumFault, match="No identification"):
        await identify_drive(line, 1)


@pytest.mark.parametrize(
    "minute",
    [LastMinute(damaged=1), LastMinute(foreign=1), LastMinute(strays=1), LastMinute(lost=1)],
)
async def test_silence_after_a_minute_with_errors_infers_no_family(minute: LastMinute) -> None:
    line = FakeLine({1: {STATUS: 0}})
    line.counters = LineCounters(minute=minute)
    line.fail_identify(1, LOST)
    result = await found(line)
    assert result.identity is not None
    assert result.identity.candidates == ()
    assert "No identification of device 1 came through" in result.error
    with pytest.raises(ChecksumFault, match="No identification"):
        await identify_drive(line, 1)


async def test_misses_of_the_drive_itself_do_not_hide_its_family() -> None:
    own = LastMinute(good=2, lost=3)
    line = FakeLine({1: {STATUS: 0}})
    line.counters = LineCounters(minute=own, devices={1: DeviceCounters(minute=own)})
    line.fail_identify(1, LOST)
    result = await found(line)
    assert result.identity is not None
    assert result.identity.candidates == ("powerdrive", "varmeca")
