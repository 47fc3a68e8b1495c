"""A drive that was gone is identified again when it answers: another one may be there now."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tui.bus.api import LineStatus
from tui.bus.errors import ChecksumFault
from tui.bus.fake import FakeLine
from tui.drive.profile import library
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession, replaced_by
from tui.session.fleet import SCAN_AGAIN, Fleet
from tui.session.journal import Journal
from tui.session.monitor.identity_watch import CHECK_INTERVAL, DAMAGED_AGAIN_AFTER, IdentityWatch

ATV71, OTHER_ATV71, ATV312 = "ATV71HU15M3", "ATV71HU75N4", "ATV312HU09M3"
ETA = library.load("atv71")["ETA"].address


class Bench:
    """An Altivar 71 in a fleet; `answer()` is the reference of the drive that answers now."""

    def __init__(self) -> None:
        self.line = FakeLine({1: {ETA: 0x0237}})
        self.answer(ATV71)
        self.fleet = Fleet(self.line, Journal(Path()))
        known = DriveIdentity(1, "", ATV71, "", "", "atv71", ("atv71",))
        self.session = DriveSession(self.line, 1, library.load("atv71"), known)
        self.fleet.take(self.session)
        self.fleet.line_watch.stop()  # its own watch would be the first to identify
        self.session.arming.arm()
        self.session.image.confirm("HSP", 500, self.session.clock.monotonic())
        self.watch = IdentityWatch(self.session, self.fleet.line_watch.on_identified)

    def answer(self, reference: str) -> None:
        self.line.devices[1].identity = {0: b"Schneider", 1: reference.encode()}

    async def replaced(self, reference: str) -> list[str]:
        """Lose the line, connect it to this drive, and return the messages."""
        await self.watch.step()
        self.line.become(LineStatus.LOST)
        self.answer(reference)
        self.line.become(LineStatus.CONNECTED)
        await self.line.read(1, ETA)
        assert await self.watch.step() == CHECK_INTERVAL
        return [event.text for event in self.fleet.events.events]

    @property
    def identified(self) -> int:
        return sum(type(request).__name__ == "Identify" for request in self.line.requests)


async def test_another_family_at_the_address_is_reported_and_bars_arming() -> None:
    made = Bench()
    texts = await made.replaced(ATV312)
    reported = f"Device 1 says it is {ATV312}, Altivar 312: the profile Altivar 71 does not fit it."
    assert texts == [f"{reported} {SCAN_AGAIN}"]
    assert not made.session.arming.armed
    assert reported in made.session.arming.barred
    assert "HSP" not in made.session.image.raws
    assert made.fleet.found[1].identity.reference == ATV312
    stopped_as = made.fleet.stopper._by_its_own(made.session)
    assert stopped_as.profile.id == "atv312", "the words of the other family stop it"
    await made.replaced(ATV71)
    assert not made.session.arming.barred
    assert made.fleet.stopper._by_its_own(made.session) is made.session


async def test_another_drive_of_the_family_is_reported_and_disarmed() -> None:
    made = Bench()
    [text] = await made.replaced(OTHER_ATV71)
    assert text.startswith(f"Device 1 is another drive now: Schneider {OTHER_ATV71}.")
    assert not made.session.arming.armed
    assert not made.session.arming.barred


async def test_other_family_gets_its_profile_by_a_scan_although_the_motor_ran() -> None:
    made = Bench()
    made.session.note_command()
    await made.replaced(ATV312)
    identity = made.fleet.found[1].identity
    made.fleet.take(DriveSession(made.line, 1, library.load("atv312"), identity))
    made.fleet.line_watch.stop()
    assert made.fleet.sessions[0].profile.id == "atv312"


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (("PUMP 7", "atv71"), ("PUMP 7", None)),  # its profile was found by registers
        (("", "atv71"), ("", "atv71")),
        (("", None), (ATV71, "atv71")),  # it had not identified itself
    ],
)
def test_identity_that_is_only_read_in_another_way_replaces_no_drive(
    before: tuple[str, str | None], now: tuple[str, str | None]
) -> None:
    known, found = (
        DriveIdentity(1, "", reference, "", "", profile, ("atv71",))
        for reference, profile in (before, now)
    )
    session = DriveSession(FakeLine({1: {}}), 1, library.load("atv71"), known)
    session.arming.arm()
    assert replaced_by(session, found) == ""
    assert session.arming.armed


async def test_same_drive_stays_armed_and_keeps_its_values() -> None:
    made = Bench()
    assert await made.replaced(ATV71) == []
    assert made.session.arming.armed
    assert "HSP" in made.session.image.raws


async def test_drive_is_identified_once_after_a_long_silence_and_not_after_a_lost_reply() -> None:
    made = Bench()
    state, now = made.line.device_state(1), made.session.clock.monotonic()
    for seconds, expected in ((0.5, 0), (3.0, 1)):
        silent = replace(state, answers=False, silent_since=now - seconds)
        made.line.devices[1].state = silent
        await made.watch.step()
        made.line.devices[1].state = replace(state, answers=True, silent_since=None)
        for _ in range(3):
            await made.watch.step()
        assert made.identified == expected


async def test_damaged_identification_is_requested_again_later() -> None:
    made = Bench()
    await made.watch.step()
    made.line.fail_identify(1, ChecksumFault(1, 43, 0), times=20)
    made.line.become(LineStatus.CONNECTED)
    await made.line.read(1, ETA)
    assert await made.watch.step() == DAMAGED_AGAIN_AFTER
    made.line.fail_identify(1, ChecksumFault(1, 43, 0), times=0)
    before = made.identified
    assert await made.watch.step() == CHECK_INTERVAL
    assert made.identified > before
