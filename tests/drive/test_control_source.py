"""Configurations of the manuals: the current one, and the changes to another."""

from __future__ import annotations

import pytest

from tui.drive.control_source import source_changes, source_codes, source_in_force
from tui.drive.profile import library
from tui.drive.values import check_raw

FAMILIES = ["atv21", "atv31", "atv312", "atv71"]
# manual, family by family: what each configuration sets
MANUAL = {
    ("atv21", "network"): {"CMOD": 2, "FMOD": 4},
    ("atv21", "terminals"): {"CMOD": 0, "FMOD": 1},
    ("atv21", "input"): {"CMOD": 0, "FMOD": 1, "F112": 48},
    ("atv21", "reference-input"): {"CMOD": 2, "FMOD": 4, "F207": 1, "F112": 38},
    ("atv71", "io"): {"CHCF": 3, "FR1": 164, "CD1": 10},
    ("atv71", "io-li5"): {
        "CHCF": 3, "FR1": 164, "CD1": 10, "CD2": 1, "CCS": 133, "FR1B": 1, "RCB": 133,
    },
    ("atv71", "drivecom"): {"CHCF": 1, "FR1": 164},
    ("atv71", "drivecom-li5"): {"CHCF": 1, "FR1": 164, "FR2": 1, "RFC": 133},
    ("atv71", "drivecom-reference-li5"): {
        "CHCF": 2, "FR1": 164, "CD1": 10, "CCS": 98, "FR1B": 1, "RCB": 133,
    },
}  # fmt: skip

FIXED = {"RFC": 96, "CCS": 98, "RCB": 96}


@pytest.mark.parametrize(("family", "id"), MANUAL)
def test_configuration_sets_the_values_of_its_manual(family: str, id: str) -> None:
    sources = {source.id: source for source in library.load(family).data.control_sources}
    settings = {setting.parameter: setting.value for setting in sources[id].settings}
    assert settings.items() >= MANUAL[family, id].items()
    # otherwise only switches, at a value where no other channel becomes active
    rest = settings.keys() - MANUAL[family, id].keys()
    assert {code: settings[code] for code in rest}.items() <= FIXED.items()


@pytest.mark.parametrize("family", FAMILIES)
def test_written_configuration_is_recognized(family: str) -> None:
    profile = library.load(family)
    assert profile.data.control_sources
    for source in profile.data.control_sources:
        raws = dict.fromkeys(source_codes(profile), 7)
        raws |= {setting.parameter: setting.value for setting in source.settings}
        assert source_in_force(profile, raws) is source
        assert source_changes(profile, source, raws) == []


@pytest.mark.parametrize("family", FAMILIES)
def test_every_value_of_a_configuration_is_writable(family: str) -> None:
    profile = library.load(family)
    for source in profile.data.control_sources:
        for setting in source.settings:
            parameter = profile[setting.parameter]
            assert parameter.access.startswith("rw"), parameter.code
            assert setting.value in profile.names(parameter), parameter.code
            check_raw(parameter, setting.value, profile.names(parameter), None)


def test_more_specific_configuration_is_preferred() -> None:
    profile = library.load("atv21")
    found = source_in_force(profile, {"CMOD": 0, "FMOD": 1, "F112": 48})
    assert found is not None
    assert found.id == "input"


def test_unread_word_matches_no_configuration() -> None:
    profile = library.load("atv21")
    assert source_in_force(profile, {"CMOD": 2}) is None
    unread = source_changes(profile, profile.data.control_sources[0], {"CMOD": 2})
    assert [(change.parameter.code, change.old) for change in unread] == [("FMOD", None)]
