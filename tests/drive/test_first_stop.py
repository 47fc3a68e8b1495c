"""The word sent before a drive is identified stops it, whatever its family."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest

from tui.drive.first_stop import (
    FirstWord,
    families_beside,
    first_word,
    followers,
    stop_places,
)
from tui.drive.orders import GENTLE_FIRST
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId
from tui.drive.profile.stop_profile import StopProfile, stop_profile

FACTS = stop_profile()
PLACES = {stop_place.address: stop_place for stop_place in stop_places(FACTS)}
CMD, CHCF, DOTD, ETA, LEROY, LEROY_STATUS = 8501, 8401, 8652, 3201, 641, 1039
ENABLED, HALF_WAY = 0x0027, 0x0021
NAMED = [(), ("atv31",), ("atv312",), ("atv71",)]
WAYS: list[OrderId] = ["stop", "quick-stop", "freewheel"]


def word(address: int, raws: dict[int, int], way: OrderId = "stop", *named: str) -> int | None:
    found = first_word(PLACES[address], raws, way, named)
    return None if found is None else found.word


@pytest.mark.parametrize("stop_profile", FACTS, ids=lambda item: item.id)
def test_stop_profile_equals_the_full_profile(stop_profile: StopProfile) -> None:
    profile = library.load(stop_profile.id)
    assert stop_profile.charts == tuple(profile.data.charts)
    assert stop_profile.names_itself is (profile.function(43) is not None)
    assert {code: profile[code].address for code in stop_profile.places} == dict(
        stop_profile.places
    )
    needed = {chart.status for chart in stop_profile.charts} | {
        chart.command for chart in stop_profile.charts
    }
    needed |= {chart.when.parameter for chart in stop_profile.charts if chart.when}
    assert needed - {""} <= set(stop_profile.places)


def test_own_profile_is_included() -> None:
    folder = library.user_folder()
    folder.mkdir(parents=True)
    packaged = library.packaged_folder()
    for name in ("atv71.toml",):
        text = (packaged / name).read_text().replace('id = "atv71"', 'id = "pump"', 1)
        (folder / "pump.toml").write_text(text)
    found = {profile.id: profile for profile in stop_profile()}
    assert found["pump"].charts == found["atv71"].charts
    assert set(found["atv71"].places) <= set(found["pump"].places)


def test_named_families_then_silent_ones_come_first() -> None:
    assert [place.address for place in stop_places(FACTS)] == [LEROY, CMD, 0xFA00]
    named = stop_places(FACTS, ["atv312"])
    assert named[0].families[0].id == "atv312"
    assert [place.address for place in named] == [CMD, LEROY, 0xFA00]


def test_command_register_of_one_family_is_not_a_setting_of_another() -> None:
    """A word for one kind must not change a setting of another."""
    for place in PLACES.values():
        stopped = {family.id for family in place.families}
        for fact in FACTS:
            taken = {p.address for p in library.load(fact.id).parameters if p.function == 3}
            assert fact.id in stopped or place.address not in taken


def states() -> Iterator[dict[int, int]]:
    """Words that may be read of drives stopped by CMD, some of them unread."""
    for chcf, dotd, eta in itertools.product((None, 0, 1, 2, 3), (None, 0, 1), (None, ENABLED, 8)):
        reported = {CHCF: chcf, DOTD: dotd, ETA: eta}
        yield {address: raw for address, raw in reported.items() if raw is not None}


@pytest.mark.parametrize("named", NAMED)
@pytest.mark.parametrize("way", WAYS)
def test_first_stop_word_stops_every_family_and_starts_none(
    way: OrderId, named: tuple[str, ...]
) -> None:
    sent = 0
    for raws in states():
        found = first_word(PLACES[CMD], raws, way, named)
        if found is None:
            continue
        sent += 1
        for family in found.families:
            for chart in family.charts:
                known = {c: raws[a] for c, a in family.places.items() if a in raws}
                if not chart.orders or (chart.when and chart.when.holds(known) is False):
                    continue
                intended = {o.id for o in chart.orders if o.words == [found.word]}
                assert intended & set(GENTLE_FIRST), (raws, family.id, chart.id, hex(found.word))
    assert sent > 20


@pytest.mark.parametrize("named", NAMED)
def test_first_stop_word_ramps_only_if_the_profile_is_certain(
    named: tuple[str, ...],
) -> None:
    assert word(CMD, {ETA: ENABLED, CHCF: 1}, "stop", *named) == 0x0007
    assert word(CMD, {ETA: ENABLED, CHCF: 1}, "quick-stop", *named) == 0x0002
    # 16#0007 would run the motor there
    assert word(CMD, {ETA: ENABLED, CHCF: 3}, "stop", *named) == 0x0000
    assert word(CMD, {ETA: ENABLED}, "stop", *named) == 0x0000
    assert word(CMD, {}, "quick-stop", *named) == 0x0000


def test_no_word_is_sent_to_an_undescribed_profile() -> None:
    assert word(CMD, {CHCF: 0, DOTD: 1}) is None


def test_drive_that_would_coast_is_halted() -> None:
    """DOTD = 0: Disable operation lets an Altivar 71 coast; only that has DOTD."""
    assert word(CMD, {CHCF: 1, DOTD: 0, ETA: ENABLED}) == 0x010F
    assert word(CMD, {CHCF: 1, DOTD: 0, ETA: HALF_WAY}) == 0x0007
    assert word(CMD, {CHCF: 1, DOTD: 1, ETA: ENABLED}) == 0x0007
    # the named family may still be present, and 16#010F does not stop it
    assert word(CMD, {CHCF: 1, DOTD: 0, ETA: ENABLED}, "stop", "atv312") == 0x0007


def test_leroy_somer_stop_word_depends_on_its_state() -> None:
    assert word(LEROY, {LEROY_STATUS: 3}) == 0x0001
    assert word(LEROY, {LEROY_STATUS: 5}) == 0x0000
    assert word(LEROY, {}) == 0x0000


def test_unidentified_drive_is_followed_by_families_with_the_same_word() -> None:
    """Altivar 312's own stop, 16#0007, runs an Altivar 71 that 16#0000 has just stopped."""

    def following(raws: dict[int, int], *named: str) -> tuple[str, ...]:
        found = first_word(PLACES[CMD], raws, "stop", named)
        assert isinstance(found, FirstWord)
        return followers(found, raws, "stop")

    assert following({CHCF: 3}) == ("atv71",)
    assert following({CHCF: 3}, "atv312") == ("atv71",)
    assert following({}, "atv312") == ("atv71",)
    assert set(following({CHCF: 1}, "atv312")) == {"atv31", "atv312", "atv71"}


def test_families_named_together_share_a_register() -> None:
    assert {profile.id for profile in families_beside(FACTS, "atv312")} == {
        "atv31",
        "atv312",
        "atv71",
    }
    assert {profile.id for profile in families_beside(FACTS, "atv21")} == {"atv21"}
