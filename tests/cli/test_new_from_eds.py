"""`profiles new --from-eds`: objects of a CANopen data sheet with registers by the user's rule."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.drive.errors import ProfileError
from tui.drive.profile import library
from tui.drive.profile.eds_file import profile_from_eds
from tui.drive.profile.profile import Profile

from .commands import ended

RULE = "3000 + 100 * (index - 16#2000) + sub - 1"
HEAD = "[FileInfo]\nFileName=drive.eds\n\n[DeviceInfo]\nVendorName=Example\n\n"
LIMITED = "LowLimit=0x0001\nHighLimit=6000\nDefaultValue=0x1E\n"


def section(name: str, title: str, kind: int, access: str = "rw", more: str = "") -> str:
    return f"[{name}]\nParameterName={title}\nDataType=0x{kind:04X}\nAccessType={access}\n{more}\n"


PARENT = "[203C]\nParameterName=Motion\nObjectType=0x9\nSubNumber=3\n\n"
COUNT = section("203Csub0", "Number of entries", 5, "const")
ACC = section("203Csub2", "Acceleration", 6, more=LIMITED)
SLIP = section("203Csub15", "Slip", 3, more="LowLimit=0xFF9C\nHighLimit=100\nDefaultValue=0\n")
WIDE = section("203Dsub1", "Energy", 7, "ro")
NAME = section("2008", "Device name", 9, "ro")
CANOPEN = section("1017", "Producer heartbeat", 6, more="DefaultValue=$NODEID+0x10\n")
SHEET = HEAD + PARENT + COUNT + ACC + SLIP + WIDE + NAME + CANOPEN


def made(tmp_path: Path, sheet: str = SHEET, *rules: str) -> Profile:
    path = tmp_path / "drive.eds"
    path.write_bytes(sheet.encode("latin-1"))
    options = [part for rule in rules or (RULE,) for part in ("--address-rule", rule)]
    ended(0, "profiles", "new", "my-eds", "--from-eds", path, *options)
    own = library.user_folder() / "my-eds.toml"
    ended(0, "profiles", "--check", own)
    library.load.cache_clear()
    return library.load("my-eds")


def test_objects_become_parameters_at_the_addresses_of_the_rule(tmp_path: Path) -> None:
    # Windows line ends, and a name in Latin-1, as such files have them
    profile = made(tmp_path, SHEET.replace("Slip", "Slip é").replace("\n", "\r\n"))
    rows = {p.code: (p.address, p.number, p.type, p.access) for p in profile.parameters}
    assert rows == {
        "203C.2": (9001, "203C/2", "uint16", "rw"),
        "203C.15": (9020, "203C/15", "int16", "rw"),
        "203D.1": (9100, "203D/1", "uint32", "r"),
    }
    acceleration, slip = profile["203C.2"], profile["203C.15"]
    assert (acceleration.min, acceleration.max, acceleration.factory) == (1, 6000, 30)
    assert (slip.name, slip.min, slip.max, slip.factory) == ("Slip é", -100, 100, 0)
    assert {p.confidence for p in profile.parameters} == {"unverified"}
    text = (library.user_folder() / "my-eds.toml").read_text("utf-8")
    assert "# 2008/0: its data type 9 has no plain register" in text
    assert "1017" not in text, "objects of CANopen itself have no registers"


def test_first_rule_whose_range_has_an_object_gives_its_address(tmp_path: Path) -> None:
    profile = made(tmp_path, SHEET, "203D-203D: 16#100 + sub", "203C-203C: sub")
    assert {p.code: p.address for p in profile.parameters} == {
        "203C.2": 2, "203C.15": 21, "203D.1": 257,
    }  # fmt: skip


def test_equal_names_get_their_codes(tmp_path: Path) -> None:
    profile = made(tmp_path, SHEET.replace("Slip", "acceleration"))
    assert profile["203C.15"].name == "acceleration 203C.15"


def test_sheet_without_a_rule_is_refused_in_plain_words(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_text(SHEET, encoding="utf-8")
    refused = ended(2, "profiles", "new", "my-eds", "--from-eds", path)
    assert "not Modbus registers" in refused.stderr
    assert "no use on Modbus" in refused.stderr
    assert not library.user_folder().exists() or not list(library.user_folder().iterdir())


def test_options_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_text(SHEET, encoding="utf-8")
    rule = ("--address-rule", RULE)
    ended(2, "profiles", "new", "my-eds", "--from-eds", path, "--from", "atv71", *rule)
    ended(2, "profiles", "new", "my-eds", "--from", "atv71", *rule)
    ended(2, "profiles", "--from-eds", path, *rule)
    gone = ended(2, "profiles", "new", "my-eds", "--from-eds", tmp_path / "none.eds", *rule)
    assert "none.eds: cannot be read" in gone.stderr


@pytest.mark.parametrize(
    ("sheet", "rule", "reason"),
    [
        ("", RULE, "no object that the rule gives a register"),
        ("not a section\n", RULE, "it is not an EDS: File contains no section headers"),
        (SHEET + ACC, RULE, "it is not an EDS: .*203Csub2.* already exists"),
        (HEAD + ACC + "DataType=6\n", RULE, "it is not an EDS: .*datatype.* already exists"),
        (SHEET, "index +", "is not a rule"),
        (SHEET, "index.real", "is not a rule"),
        (SHEET, "100 // (sub - 2)", "divides by 0"),
        (SHEET, "100", r"\[203Csub15\] the rule gives it address 100, which 203C\.2 has"),
        (SHEET, "100 * index", "an address is 0 to 65535"),
        (SHEET, "number", "needs number"),
        (SHEET, "3000-2000: sub", "the first object is above the last one"),
        (SHEET.replace("0x1E", "thirty"), RULE, r"drive\.eds:17: \[203Csub2\] .*'thirty' is not"),
        (SHEET.replace("AccessType=ro", "AccessType=yes"), RULE, "'yes' is not ro, rw, wo"),
        (SHEET.replace("DataType=0x0006", "DataType=six"), RULE, "'six' is not a whole number"),
    ],
)
def test_wrong_sheet_or_rule_is_refused_with_its_place(sheet: str, rule: str, reason: str) -> None:
    with pytest.raises(ProfileError, match=reason):
        profile_from_eds(sheet.encode(), "my-eds", "drive.eds", [rule])


@pytest.mark.parametrize("data", [b"\0" * 999, b"\xff\xfe[\0a\0", b"[2000]\n" * 3, b"=\n[[[]]]\n"])
def test_garbage_is_refused(data: bytes) -> None:
    with pytest.raises(ProfileError):
        profile_from_eds(data, "my-eds", "drive.eds", [RULE])
