"""A learned scale is stored with its drive, used immediately, and discarded by a disagreeing
reading.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tui.drive.errors import ValueRefused
from tui.drive.teaching import LessonKind
from tui.session.command.reference import Reference, parse_reference, reference_codes
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.read.reader import Reader
from tui.session.teaching.teacher import TaughtDrive, Teacher

from .fakes import OneDrive, parameter, profile_of

RAW: dict[str, Any] = {"access": "r", "confidence": "unverified"}
PROFILE = profile_of(
    parameter("HZ", 500, **RAW),
    parameter("AMPS", 400, **RAW),
    parameter("PRESET", 120, **RAW),
    parameter("MOST", 121, **RAW),
    parameter("KNOWN", 600, unit="V"),
    teachable_references=[{"parameter": "PRESET", "most": "MOST"}],
)
NAMED = DriveIdentity(1, "Maker", "A-1", "1.0", "", None, ())
OTHER = DriveIdentity(1, "Maker", "B-2", "1.0", "", None, ())


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A separate state folder."""
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path))
    return tmp_path


def drive(identity: DriveIdentity | None = None, **words: int) -> tuple[OneDrive, Teacher]:
    """A drive with its words by code, and its teacher, which has loaded the stored scales."""
    held = {parameter.address: 0 for parameter in PROFILE.parameters}
    held |= {PROFILE[code].address: word for code, word in words.items()}
    line = OneDrive(held)
    teacher = Teacher(DriveSession(line, 1, PROFILE, identity))
    teacher.recall()
    return line, teacher


def kept(folder: Path, ending: str = "json") -> Path:
    """The only file of learned scales, or of files set aside."""
    (path,) = folder.glob(f"taught/*.{ending}")
    return path


async def shown(teacher: Teacher, code: str = "HZ") -> str:
    """Text of the drive's value, and its mark."""
    value = (await Reader(teacher.session).read([code]))[code].value
    assert value is not None
    return f"{value.display}{' taught' if value.taught else ''}"


async def two_readings(line: OneDrive, teacher: Teacher) -> None:
    """Teach HZ: 0.1 Hz a count."""
    line.registers[500] = 300
    assert (await teacher.look("HZ", "30.0", "Hz")).kind is LessonKind.FIRST
    line.registers[500] = 503
    assert (await teacher.look("HZ", "50.3")).kind is LessonKind.TAUGHT


async def test_value_has_its_unit_from_the_second_reading_on() -> None:
    line, teacher = drive()
    assert await shown(teacher) == "0"
    await two_readings(line, teacher)
    assert await shown(teacher) == "50.3 Hz taught"
    assert teacher.session.profile["HZ"].unit == "Hz"
    assert teacher.session.family["HZ"].unit == "", "the family learns nothing"
    assert await shown(teacher, "AMPS") == "0"


async def test_learned_scale_is_stored_for_line_and_device() -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    _, later = drive(HZ=250)
    assert await shown(later) == "25.0 Hz taught"
    elsewhere = Teacher(DriveSession(OneDrive({500: 250}, device=2), 2, PROFILE))
    elsewhere.recall()
    assert await shown(elsewhere) == "250"


async def test_other_drive_at_the_address_does_not_get_the_scale() -> None:
    line, teacher = drive(NAMED)
    await two_readings(line, teacher)
    _, other = drive(OTHER, HZ=250)
    assert await shown(other) == "250"
    _, same = drive(NAMED, HZ=250)
    assert await shown(same) == "25.0 Hz taught"
    _, unsaid = drive(None, HZ=250)
    assert await shown(unsaid) == "25.0 Hz taught", "its profile was named, it was not asked"


async def test_unidentified_drive_gets_no_scale_if_two_were_learned() -> None:
    for who in (NAMED, OTHER):
        line, teacher = drive(who)
        await two_readings(line, teacher)
    _, unsaid = drive(None, HZ=250)
    assert await shown(unsaid) == "250"


async def test_disagreeing_third_reading_discards_the_stored_scale() -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    line.registers[500] = 400
    lesson = await teacher.look("HZ", "20.0")
    assert lesson.kind is LessonKind.ENDED
    assert await shown(teacher) == "400"
    _, later = drive(HZ=250)
    assert await shown(later) == "250"


async def test_unknown_sign_leaves_the_word_raw() -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    line.registers[500] = 65036
    assert await shown(teacher) == "65036 raw"
    assert (await teacher.look("HZ", "-50.0")).kind is LessonKind.AGREES
    assert await shown(teacher) == "-50.0 Hz taught"


async def test_scaled_value_cannot_be_learned() -> None:
    line, teacher = drive()
    with pytest.raises(ValueRefused, match="is already known"):
        await teacher.look("KNOWN", "12")
    assert line.requested == []


async def test_invalid_number_is_refused_before_any_request() -> None:
    line, teacher = drive()
    with pytest.raises(ValueRefused, match="not a displayed value"):
        await teacher.look("HZ", "fast")
    assert line.requested == []


async def test_forgetting_removes_the_learned_scale() -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    assert teacher.forget("HZ")
    assert not teacher.forget("HZ")
    assert await shown(teacher) == "503"
    _, later = drive(HZ=250)
    assert await shown(later) == "250"


async def test_scales_learned_by_two_programs_are_kept() -> None:
    line, teacher = drive()
    other_line, other = drive()
    await two_readings(line, teacher)
    other_line.registers[400] = 84
    await other.look("AMPS", "8.4", "A")
    other_line.registers[400] = 120
    await other.look("AMPS", "12.0")
    _, later = drive(HZ=250, AMPS=50)
    assert await shown(later) == "25.0 Hz taught"
    assert await shown(later, "AMPS") == "5.0 A taught"


# The reference


async def preset(unit: str = "Hz") -> Teacher:
    """A drive whose preset has a learned scale, 0.1 per count."""
    line, teacher = drive(PRESET=300)
    await teacher.look("PRESET", "30.0", unit)
    line.registers[120] = 400
    await teacher.look("PRESET", "40.0")
    return teacher


async def test_confirmed_preset_accepts_the_reference() -> None:
    teacher = await preset()
    session = teacher.session
    assert teacher.proposal() == "PRESET"
    assert session.profile.quantity("command_frequency") is None, "not before a person confirms"
    assert "Hz" in teacher.confirm_reference("PRESET")
    assert session.profile.quantity("command_frequency") == session.profile["PRESET"]
    assert (teacher.proposal(), teacher.reference) == ("", "PRESET")
    _, later = drive()
    assert later.reference == "PRESET"
    later.drop_reference()
    assert later.session.profile.quantity("command_frequency") is None
    _, last = drive()
    assert last.reference == ""


async def test_preset_in_rpm_accepts_a_speed() -> None:
    teacher = await preset("rpm")
    teacher.confirm_reference("PRESET")
    assert teacher.session.profile.quantity("command_speed") is not None
    assert teacher.session.profile.quantity("command_frequency") is None


@pytest.mark.parametrize(("unit", "why"), [("%", "needs Hz or rpm"), ("", "no unit")])
async def test_preset_in_another_unit_accepts_no_reference(unit: str, why: str) -> None:
    teacher = await preset(unit)
    assert teacher.proposal() == ""
    with pytest.raises(ValueRefused, match=why):
        teacher.confirm_reference("PRESET")


async def test_value_without_a_scale_or_preset_is_refused() -> None:
    line, teacher = drive()
    with pytest.raises(ValueRefused, match="not learned yet"):
        teacher.confirm_reference("PRESET")
    await two_readings(line, teacher)
    with pytest.raises(ValueRefused, match="Use PRESET"):
        teacher.confirm_reference("HZ")


async def test_discarded_scale_ends_the_reference_and_its_confirmation() -> None:
    teacher = await preset()
    teacher.confirm_reference("PRESET")
    assert (await teacher.look("PRESET", "20.0")).kind is LessonKind.ENDED
    assert teacher.session.profile.quantity("command_frequency") is None
    again = await preset()
    assert again.reference == "", "confirmed anew, or not at all"


async def presets(limit_unit: str) -> tuple[OneDrive, Teacher]:
    """A drive whose preset accepts the reference in rpm, and whose maximum reference is 1500."""
    line, teacher = drive(PRESET=300, MOST=1500)
    await teacher.look("PRESET", "300", "rpm")
    line.registers[120] = 400
    await teacher.look("PRESET", "400")
    teacher.confirm_reference("PRESET")
    await teacher.look("MOST", "1500", limit_unit)
    line.registers[121] = 900
    await teacher.look("MOST", "900")
    return line, teacher


async def parsed(teacher: Teacher, text: str) -> Reference:
    """A typed reference, checked against the values of the drive."""
    profile = teacher.session.profile
    readings = await Reader(teacher.session).read(reference_codes(profile))
    return parse_reference(profile, text, readings)


async def test_reference_is_given_in_the_learned_unit() -> None:
    teacher = await preset("Hz")
    teacher.confirm_reference("PRESET")
    found = await parsed(teacher, "25.5")
    assert (found.parameter.code, found.raw, found.text) == ("PRESET", 255, "25.5 Hz")
    with pytest.raises(ValueRefused, match="takes its reference in Hz"):
        await parsed(teacher, "700rpm")


async def test_maximum_reference_applies_if_learned_in_the_same_unit() -> None:
    _, teacher = await presets("rpm")
    assert (await parsed(teacher, "900rpm")).raw == 900
    with pytest.raises(ValueRefused, match="above MOST = 900 rpm"):
        await parsed(teacher, "901rpm")
    teacher.forget("MOST")
    assert (await parsed(teacher, "901rpm")).raw == 901
    _, other = await presets("Hz")
    assert (await parsed(other, "901rpm")).raw == 901, "another unit says nothing"


async def test_reference_that_could_be_negative_is_refused() -> None:
    teacher = await preset("Hz")
    teacher.confirm_reference("PRESET")
    assert (await parsed(teacher, "3276.7")).raw == 0x7FFF
    with pytest.raises(ValueRefused, match="sign of such values"):
        await parsed(teacher, "3276.8")


@pytest.mark.parametrize(
    ("taught", "says"),
    [(False, "teach PRESET: L in the panel"), (True, "R in the panel, or drivepanel teach PRESET")],
)
async def test_missing_reference_names_next_step(taught: bool, says: str) -> None:
    teacher = await preset() if taught else drive()[1]
    with pytest.raises(ValueRefused, match="No available manual") as reported:
        await parsed(teacher, "20")
    assert says in str(reported.value)


# Files


HOSTILE = {
    "no json": "{",
    "binary": "\x00\x01",
    "another thing": "[1, 2]",
    "no looks": '{"line": "x"}',
    "looks of no kind": '{"looks": 3}',
    "a list of numbers": '{"looks": {"HZ": [1, 2]}}',
    "a word past the last": '{"looks": {"HZ": [{"raw": 70000, "shown": "1"}]}}',
    "a word that is true": '{"looks": {"HZ": [{"raw": true, "shown": "1"}]}}',
    "shown is no number": '{"looks": {"HZ": [{"raw": 1, "shown": "1e9999"}]}}',
    "a unit that commands a terminal": '{"looks": {"HZ": [{"raw": 1, "shown": "1 \\u001b[2J"}]}}',
    "a code that is none": '{"looks": {"a b": []}}',
    "too many": json.dumps({"looks": {"HZ": [{"raw": 1, "shown": "1"}] * 9}}),
    "endless": "[" * 100_000,
    "too long": json.dumps({"looks": {}, "x": "x" * 200_001}),
    "a reference of no kind": '{"looks": {}, "reference": 3}',
}  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
async def test_damaged_file_is_reported_and_kept(folder: Path, text: str) -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    path = kept(folder)
    path.write_text(text, "utf-8")
    line, teacher = drive(HZ=250)
    assert str(path) in teacher.trouble
    assert "are not used" in teacher.trouble
    assert await shown(teacher) == "250"
    assert path.read_text("utf-8") == text, "looking at it changes nothing"
    await two_readings(line, teacher)
    assert teacher.trouble == ""
    assert kept(folder, "damaged1").read_text("utf-8") == text
    assert await shown(drive(HZ=250)[1]) == "25.0 Hz taught"


async def test_contradicting_readings_give_no_scale(folder: Path) -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    path = kept(folder)
    reported = json.loads(path.read_text("utf-8"))
    reported["looks"]["HZ"][1]["shown"] = "70.0 Hz"
    path.write_text(json.dumps(reported), "utf-8")
    assert await shown(drive(HZ=250)[1]) == "250"


async def test_unknown_code_is_kept_but_not_used(folder: Path) -> None:
    line, teacher = drive()
    await two_readings(line, teacher)
    path = kept(folder)
    reported = json.loads(path.read_text("utf-8"))
    reported["looks"]["GONE"] = reported["looks"]["HZ"]
    reported["looks"]["KNOWN"] = reported["looks"]["HZ"]
    path.write_text(json.dumps(reported), "utf-8")
    line, later = drive(HZ=250, KNOWN=230)
    assert later.trouble == ""
    assert await shown(later, "KNOWN") == "230 V"
    later.forget("HZ")
    assert set(json.loads(path.read_text("utf-8"))["looks"]) == {"GONE", "KNOWN"}


async def test_unwritable_folder_is_reported_and_the_scale_is_used(
    folder: Path,
) -> None:
    (folder / "taught").write_text("in the way")
    line, teacher = drive()
    await two_readings(line, teacher)
    assert "are lost when" in teacher.trouble
    assert await shown(teacher) == "50.3 Hz taught"


def test_file_is_found_for_any_spelling_of_the_line() -> None:
    drive = TaughtDrive.of("serial:/dev/ttyS9,19200,8E1", 4, "powerdrive", None)
    assert drive.file == TaughtDrive.of("/dev/ttyS9", 4, "powerdrive", None).file
    assert drive.file != TaughtDrive.of("/dev/ttyS9", 5, "powerdrive", None).file
    assert drive.file != TaughtDrive.of("/dev/ttyS9", 4, "varmeca", None).file
