"""Profile data for finding drives: settings by likelihood, reads, timeouts."""

from __future__ import annotations

import pytest

from tests.session.fakes import profile_of
from tui.drive.finding import (
    LineSetting,
    PresenceProbe,
    families_at,
    likely_settings,
    longest_turnaround,
    presence_probes,
    silent_cost,
    wait_for_reply,
    watching_families,
    watching_text,
)
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.sentences import all_of


@pytest.fixture(scope="module")
def families() -> list[Profile]:
    return [library.load(listing.id) for listing in library.listings()]


def test_settings_are_ordered_from_factory_to_slowest(families: list[Profile]) -> None:
    found = likely_settings([family.data.link for family in families], longest_turnaround(families))
    assert [str(setting) for setting in found[:3]] == ["19200 8E1", "19200 8N2", "19200 8N1"]
    assert found.index(LineSetting(9600, "8E1")) < found.index(LineSetting(38400, "8E1"))
    assert str(found[-1]) == "300 8O1"
    assert len(found) == len(set(found)) == 40


def test_slow_settings_follow_all_likely_ones(
    families: list[Profile],
) -> None:
    found = likely_settings([family.data.link for family in families], longest_turnaround(families))
    slow = [setting for setting in found if setting.slow]
    assert found[-len(slow) :] == slow
    assert {setting.baud for setting in slow} == {300, 600}
    assert families_at(families, slow) == ["Powerdrive", "Proxidrive", "Varmeca 33/34"]
    # 31 addresses at all the others take less than a minute, the listening with it
    wait = longest_turnaround(families) + 0.002
    likely = [setting for setting in found if not setting.slow]
    assert (
        sum(31 * silent_cost(setting, wait_for_reply(setting, wait)) for setting in likely)
        < 60 - 1.5
    )


def test_names_are_joined_in_a_sentence() -> None:
    assert all_of([]) == "none"
    assert all_of(["300"]) == "300"
    assert all_of(["300", "600", "1200"]) == "300, 600 and 1200"


def test_faster_of_two_equally_likely_settings_comes_first() -> None:
    link = profile_of(
        link={"baud": 9600, "format": "8E1", "bauds": [300, 1200, 9600, 38400]}
    ).data.link
    found = likely_settings([link], 0.005)
    assert [setting.baud for setting in found] == [9600, 38400, 1200, 300]


def test_empty_address_costs_its_request_and_the_turnaround() -> None:
    fast, slow = LineSetting(19200, "8E1"), LineSetting(300, "8N1")
    character = 11 / 19200
    assert wait_for_reply(fast, 0.010) == pytest.approx(0.010 + character)
    assert silent_cost(fast, wait_for_reply(fast, 0.010)) == pytest.approx(0.010 + 9 * character)
    # no drive answers before the silence that ends the request
    assert wait_for_reply(slow, 0.010) == pytest.approx(4.5 * 10 / 300)


def test_one_probe_covers_every_family_without_function_43(families: list[Profile]) -> None:
    (probe,) = presence_probes(families)
    assert probe == PresenceProbe(1039, ("powerdrive", "proxidrive", "varmeca"))


def test_family_silent_at_unknown_words_is_identified() -> None:
    functions = [{"code": 3, "name": "Read"}, {"code": 43, "name": "Identify"}]
    mute = profile_of(functions=functions, reading={"unknown_exception": None})
    assert presence_probes([mute]) == (PresenceProbe(None),)
    assert presence_probes([]) == (PresenceProbe(None),)


def test_drive_with_timeout_from_first_request_is_named(families: list[Profile]) -> None:
    found = watching_families(families)
    assert [family.id for family in found if family.sure] == ["atv21"]
    assert "atv71" not in {family.id for family in found}
    reported = watching_text(found)
    assert "Altivar 21 (F803), and perhaps Altivar 31 (ttO)" in reported
    assert watching_text([]) == ""
