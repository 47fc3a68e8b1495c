"""A simulated drive leaves the factory as its profile says, and follows its mains standard."""

from __future__ import annotations

import pytest

from tui.drive.profile.library import load
from tui.drive.settings.factory import factory_raw, not_factory
from tui.simulator import DriveSpec, SimulatedDrive

COMMISSIONED = {
    # family: what a drive set up for its line holds otherwise
    "atv21": set[str](),
    "atv31": {"Fr1", "Cd1", "tCt", "LAC"},
    "atv312": {"Fr1", "Cd1", "tCt", "LAC"},
    "atv71": {"FR1", "CD1", "TCT"},
}


def drive(profile: str, **more: object) -> SimulatedDrive:
    return SimulatedDrive(load(profile), DriveSpec(profile, 2, **more))  # type: ignore[arg-type]


def raws_of(simulated: SimulatedDrive) -> dict[str, int]:
    return {p.code: simulated.raw(p.code) for p in simulated.profile.parameters}


@pytest.mark.parametrize("family", COMMISSIONED)
def test_drive_starts_with_the_factory_settings_of_its_profile(family: str) -> None:
    simulated = drive(family)
    profile, raws = simulated.profile, raws_of(simulated)
    line = {setting.parameter for setting in profile.data.link.settings}
    changed = {p.code for p in profile.parameters if not_factory(profile, p, raws)} - line
    assert changed == COMMISSIONED[family]


@pytest.mark.parametrize(
    ("family", "code", "times"),
    [("atv31", "CLI", 1.5), ("atv312", "IdC", 0.7), ("atv71", "SDC2", 0.5)],
)
def test_current_values_start_as_a_share_of_the_rated_current(
    family: str, code: str, times: float
) -> None:
    simulated = drive(family)
    current = simulated.raw("INV")
    assert current > 0
    assert simulated.raw(code) == int(times * current)


def test_mains_standard_sets_its_speeds() -> None:
    simulated = drive("atv31")
    profile = simulated.profile
    assert [simulated.raw(c) for c in ("HSP", "tFr", "FrS", "Ftd")] == [500, 600, 500, 500]
    write = bytes.fromhex(f"06{profile['bFr'].address:04X}0001")
    assert simulated.line_side.answer(2, write) == write
    assert [simulated.raw(c) for c in ("HSP", "tFr", "FrS", "Ftd")] == [600, 720, 600, 600]
    raws = raws_of(simulated)
    assert factory_raw(profile, profile["HSP"], raws) == 600


@pytest.mark.parametrize(("raw", "held"), [(10000, 1.5), (1, 0.2)])
def test_current_is_limited_to_its_share_of_the_rated_current(raw: int, held: float) -> None:
    """As other limits of this family are; the manual of the Altivar 31 gives 0.2 to 1.5 In."""
    simulated = drive("atv31")
    address = simulated.profile["ItH"].address
    simulated.line_side.answer(2, bytes.fromhex(f"06{address:04X}{raw:04X}"))
    assert simulated.raw("ItH") == int(held * simulated.raw("INV"))
