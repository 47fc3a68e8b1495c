"""Help for faults and alarms: a separate file, checked and read on demand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import msgspec
import pytest
import tomli

from tui.drive import small_file
from tui.drive.errors import ProfileError
from tui.drive.hints import RESETS, reset_ready, reset_text
from tui.drive.profile import json_schema, library
from tui.drive.profile.schema import AlarmHelp, FaultHelp, HelpData, ResetWay
from tui.drive.sentences import MAY_START

FAMILIES = sorted(item.id for item in library.listings())
COUNTS = {"atv21": (38, 16), "atv31": (27, 5), "atv312": (31, 5), "atv71": (74, 30)}
"""Faults and alarms of the families whose faults have numbers."""
LONGEST = 56
"""Columns that a screen of 80 has for a cause or a check."""
FOLDER = library.packaged_folder() / "help"


@pytest.mark.parametrize("family", FAMILIES)
def test_every_fault_of_a_family_has_help(family: str) -> None:
    profile = library.load_file(library.packaged_folder() / f"{family}.toml")
    none = profile.data.faults.none
    lacking = [f.code for f in profile.data.faults.codes if profile.guide.fault(f.raw) is None]
    assert lacking == [f.code for f in profile.data.faults.codes if f.raw == none]
    reported = profile.guide.data
    assert (len(reported.faults), len(reported.alarms)) == COUNTS.get(family, (1, 0))
    assert not profile.guide.trouble
    for hint in (*reported.faults, *reported.alarms):
        assert hint.source
        assert all(0 < len(text) <= LONGEST for text in (*hint.probable, *hint.check))
        assert " order" not in " ".join((*hint.probable, *hint.check))
        assert all(profile[look.code] and look.why for look in hint.look_at)


def test_help_is_loaded_separately_from_the_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    opened = small_file.open_regular

    def watched(path: Path) -> int:
        read.append(path)
        return opened(path)

    monkeypatch.setattr(small_file, "open_regular", watched)
    profile = library.load_file(library.packaged_folder() / "atv71.toml")
    assert [path for path in read if path.parent == FOLDER] == []
    assert profile.guide.fault(18) is not None
    assert profile.guide.fault(9) is not None
    assert [path.name for path in read if path.parent == FOLDER] == ["atv71.toml"]


def test_family_without_fault_numbers_has_one_help_for_any_trip() -> None:
    profile = library.load("varmeca")
    help_ = profile.guide.fault(None)
    assert help_ is not None
    assert profile.guide.fault(7) is help_
    assert help_.name.startswith("Fieldbus fault")
    assert library.load("atv71").guide.fault(None) is None


def own_drive(folder: Path, text: str, name: str = "mine") -> Path:
    """An own profile, with a help file next to it."""
    whole = (library.packaged_folder() / "atv312.toml").read_text("utf-8")
    path = folder / "mine.toml"
    own = whole.replace('id = "atv312"', f'id = "{name}"', 1)
    path.write_text(own.replace("ATV312", "OWN312"), encoding="utf-8")
    if text:
        (folder / "help").mkdir(exist_ok=True)
        (folder / "help" / f"{name}.toml").write_text(text, encoding="utf-8")
    return path


GOOD = '[[faults]]\nraw = 9\ncode = "OCF"\nprobable = ["A jam"]\n'
BROKEN = {
    "no such fault": (GOOD.replace("raw = 9", "raw = 900"), "there is no such fault"),
    "another code": (GOOD.replace("OCF", "ObF"), "the profile calls it OCF"),
    "no number": (GOOD.replace("raw = 9\n", ""), "raw is missing"),
    "two": (GOOD + GOOD, "there are two"),
    "no such parameter": (
        GOOD + 'look_at = [{ code = "NOSUCH", why = "x" }]\n',
        "look_at: there is no parameter 'NOSUCH'",
    ),
    "no such bit": (
        '[[alarms]]\nword = "ETI"\nbit = 3\nprobable = ["x"]\n',
        "there is no such bit",
    ),
    "two of an alarm": ('[[alarms]]\nword = "ETI"\nbit = 7\nprobable = ["x"]\n' * 2, "are two"),
    "no cause": (GOOD.replace('["A jam"]', "[]"), "probable"),
    "an unknown way to reset": (GOOD + 'reset = "hope"\n', "hope"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_invalid_help_file_is_reported_with_its_line(case: str, tmp_path: Path) -> None:
    text, output = BROKEN[case]
    profile = library.load_file(own_drive(tmp_path, text))
    with pytest.raises(ProfileError, match=r"help/mine\.toml:\d+: ") as caught:
        _ = profile.guide.data
    assert output in str(caught.value)
    # in use it blocks nothing: the error is shown instead of the help
    assert profile.guide.fault(9) is None
    assert "mine.toml" in profile.guide.trouble


def test_own_help_beside_an_own_profile_is_used(tmp_path: Path) -> None:
    profile = library.load_file(own_drive(tmp_path, GOOD))
    help_ = profile.guide.fault(9)
    assert help_ is not None
    assert help_.probable == ["A jam"]
    assert profile.guide.fault(5) is None


def test_own_profile_replacing_a_packaged_one_keeps_matching_help(tmp_path: Path) -> None:
    path = own_drive(tmp_path, "", "atv312")
    whole = path.read_text("utf-8").replace('raw = 9, code = "OCF"', 'raw = 9, code = "MINE"')
    path.write_text(whole, encoding="utf-8")
    profile = library.load_file(path)
    assert profile.guide.fault(9) is None
    assert profile.guide.fault(5) is not None


def test_help_in_the_profile_overrides_the_help_file(tmp_path: Path) -> None:
    path = own_drive(tmp_path, GOOD)
    row = '[[faults.help]]\nraw = 9\nprobable = ["Mine"]\n\n[monitoring]\n'
    whole = path.read_text("utf-8").replace("[monitoring]\n", row, 1)
    path.write_text(whole, encoding="utf-8")
    help_ = library.load_file(path).guide.fault(9)
    assert help_ is not None
    assert help_.probable == ["Mine"]


def test_committed_schema_of_help_is_up_to_date() -> None:
    committed = (FOLDER / "help.schema.json").read_text("utf-8")
    assert committed == json_schema.schema_text("help")
    assert json.loads(committed)["$defs"]["FaultHelp"]["additionalProperties"] is False


def test_drive_overrides_the_general_advice() -> None:
    profile = library.load("atv71")
    help_ = profile.guide.fault(9)
    assert help_ is not None
    assert help_.reset == "power-cycle"
    assert reset_ready(profile, {}) is None
    assert reset_ready(profile, {"ETI": 0x0004}) is True
    assert reset_ready(profile, {"ETI": 0xFFFB}) is False
    assert reset_ready(library.load("atv21"), {"FD01": 0xFFFF}) is None
    assert "a reset has no effect" in reset_text(help_, None, "a reset").text
    assert "works now" in reset_text(help_, True, "x").text
    assert reset_text(help_, False, "x").text.startswith("Not yet")


def test_reset_text_always_warns_of_a_motor_that_may_start() -> None:
    for way in RESETS:
        help_ = FaultHelp(raw=1, probable=["x"], reset=way)
        for ready in (None, True, False):
            assert reset_text(help_, ready, "x").text.endswith(MAY_START)
            assert reset_text(help_, ready, "x", "It may.").text.endswith("It may.")
    by_itself = FaultHelp(raw=1, probable=["x"], reset="by-itself")
    assert "may start." in reset_text(by_itself, None, "x").text


def test_ways_of_reset_match_the_sources() -> None:
    """Undervoltage ends without a reset: then a waiting run command starts the motor."""
    for family, raw in (("atv31", 22), ("atv312", 22), ("atv71", 22)):
        help_ = library.load(family).guide.fault(raw)
        assert help_ is not None
        assert help_.reset == "by-itself", family


def test_page_names_every_field_of_help() -> None:
    text = (library.packaged_folder() / "README.md").read_text("utf-8")
    fields = {
        field.name for kind in (FaultHelp, AlarmHelp) for field in msgspec.structs.fields(kind)
    }
    assert [name for name in sorted(fields) if f"`{name}`" not in text] == []
    assert [way for way in get_args(ResetWay) if f"`{way}`" not in text] == []


def test_every_help_file_belongs_to_a_profile() -> None:
    named = {p.data.faults.help_file or p.id for p in map(library.load, FAMILIES)}
    assert {path.stem for path in FOLDER.glob("*.toml")} == named
    for path in FOLDER.glob("*.toml"):
        msgspec.convert(tomli.loads(path.read_text("utf-8")), HelpData)
