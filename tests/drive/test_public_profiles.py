"""Public profiles: unproved, read at once, written only after a person confirms."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from tui.bus.fake import FakeLine
from tui.bus.link import SerialLink
from tui.cli.main import main
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.stop_profile import stop_profile
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.next_steps import end_silence
from tui.session.drive import DriveSession
from tui.simulator import DriveSpec, Simulation
from tui.simulator.proving.proof_steps import prove_profile

FILES = sorted((library.packaged_folder() / library.PUBLIC).glob("*.toml"))
CONFIDENCES = {"public", "public-x2", "analogy", "unverified"}
FACTORY = {"ms300": "ASCII", "v20": "USS", "atv320": "OFF", "atv12": "OFF"}


def test_public_profiles_are_these() -> None:
    assert {path.stem for path in FILES} == FACTORY.keys()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_public_profile_is_unproved_with_sources_and_passes(path: Path) -> None:
    profile = library.load(path.stem)
    data = profile.data
    assert library.all_faults_of(path) == []
    assert data.profile.unproved
    assert len(data.sources) >= 2
    assert {parameter.confidence for parameter in profile.parameters} <= CONFIDENCES
    assert FACTORY[path.stem] in data.link.at_factory
    assert data.frames
    assert {step.title: step.fault for step in prove_profile(profile) if step.fault} == {}


def test_each_manual_is_cited_with_its_number() -> None:
    for name in ("v20", "atv320", "atv12"):
        titles = " ".join(source.title for source in library.load(name).data.sources)
        assert re.search(r"A5E\d{8}|NVE\d{5}|BBV51917", titles), name


def test_nameplate_and_ramps_of_an_altivar_312_go_to_an_altivar_320() -> None:
    old, new = library.load("atv312"), library.load("atv320")
    [table] = new.data.predecessors
    assert table.codes.keys() >= {"bFr", "HSP", "LSP", "ACC", "dEC", "ItH", "nCr"}
    for code, other in table.codes.items():
        before, after = old[code], new[other]
        assert (before.unit, before.address) == (after.unit, after.address), code


def changed(tmp_path: Path, right: str, wrong: str) -> Path:
    text = (FILES[0].parent / "ms300.toml").read_text("utf-8")
    assert right in text
    path = tmp_path / "own.toml"
    path.write_text(text.replace(right, wrong), "utf-8")
    return path


def test_frame_with_another_meaning_fails(tmp_path: Path) -> None:
    profile = library.load_file(changed(tmp_path, '"2102H = 60.00 Hz"', '"2102H = 6.00 Hz"'))
    [fault] = [step.fault for step in prove_profile(profile) if step.fault]
    assert fault.startswith("it does not mean 2102H = 6.00 Hz, but 2102H = 16#1770, 2102H = 60.00")


@pytest.mark.parametrize(
    ("right", "wrong", "reported"),
    [
        ('sent = "01 03 21 02 00 02 6F F7"', 'sent = "01 03 21 02 00 02 6F F8"', "wrong checksum"),
        ('answered = "01 03 04', 'answered = "0x1 03 04', "is not a row of bytes"),
        ('means = ["01-00 = 60.00 Hz"]', "means = []", "`means` is empty"),
    ],
)
def test_frame_that_is_none_is_refused(
    tmp_path: Path, right: str, wrong: str, reported: str
) -> None:
    [fault] = library.faults_of(changed(tmp_path, right, wrong))
    assert reported in fault
    assert re.search(r"own\.toml:\d+: frame: ", fault)


def test_public_profiles_send_no_word_to_a_drive_of_another_family() -> None:
    public = {path.stem for path in FILES}
    assert not public & {listing.id for listing in library.listings()}
    assert not public & {profile.id for profile in stop_profile()}
    assert {listing.id for listing in library.public_listings()} == public
    assert library.matching_profiles("ATV320U07M2C") == ["atv320"]


@pytest.fixture
def uncached() -> Iterator[None]:
    """No profile is loaded before or after."""
    library.load.cache_clear()
    yield
    library.load.cache_clear()


@pytest.mark.usefixtures("uncached")
def test_own_profile_hides_a_public_one() -> None:
    folder = library.user_folder()
    folder.mkdir(parents=True)
    text = (FILES[0].parent / "v20.toml").read_text("utf-8")
    (folder / "mine.toml").write_text(text.replace("unproved = true\n", ""), "utf-8")
    assert not library.load("v20").data.profile.unproved
    assert "v20" not in {listing.id for listing in library.public_listings()}


@pytest.fixture
def session() -> DriveSession:
    return DriveSession(FakeLine({1: {}}), 1, library.load("ms300"))


def test_drive_is_armed_only_after_a_person_confirms(session: DriveSession) -> None:
    with pytest.raises(OrderRefused, match="no drive has confirmed it"):
        session.arming.arm()
    assert session.is_unconfirmed
    session.confirm_profile()
    assert not session.arming.armed
    session.arming.arm()
    assert session.arming.armed


def test_forced_profile_still_needs_a_confirmation(session: DriveSession) -> None:
    session.bar_unconfirmed()
    assert session.is_unconfirmed
    assert session.arming.barred


def test_proved_profile_needs_no_confirmation() -> None:
    proved = DriveSession(FakeLine({1: {}}), 1, library.load("atv312"))
    assert not proved.is_unconfirmed
    proved.arming.arm()


def test_command_without_a_person_reads_but_does_not_write() -> None:
    read = CliRunner().invoke(main, ["read", "sim:ms300", "-p", "ms300", "2103H"])
    assert read.exit_code == 0, read.output
    with Simulation([DriveSpec("v20", 1)]) as simulation:
        line = "tcp:{}:{}".format(*simulation.serve_tcp())
        run = CliRunner().invoke(main, ["write", line, "-p", "v20", "P1120=5", "--arm"])
    assert run.exit_code == 5, run.output
    assert "drivepanel profiles new NAME --from v20" in run.output


def test_scan_and_why_know_why_a_new_drive_is_silent() -> None:
    notes = " ".join(library.factory_notes())
    assert "ASCII with 9600 baud, 7N2" in notes
    assert "Modbus address of an Altivar 320 is OFF" in notes
    silent = DiagnosticEvidence(SerialLink("/dev/ttyUSB0"), 9, library.load("ms300"))
    assert "ASCII with 9600 baud, 7N2" in " ".join(end_silence(silent))
    assert set(library.factory_notes()) <= set(end_silence(replace(silent, profile=None)))
