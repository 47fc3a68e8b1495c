"""Guided start-up: its files, its results, its evidence; without a screen."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import tomli

from tests.sources import ROOT
from tui.bus.fake import FakeLine
from tui.drive.errors import ProfileError
from tui.drive.profile import library
from tui.session.drive import DriveSession
from tui.session.monitor.trend import TrendPoint
from tui.session.startup import start_up
from tui.session.startup.evidence import last_run, last_steady, last_stop
from tui.session.startup.guide import find_guide, read_guide
from tui.session.startup.judging import (
    AS_REQUIRED,
    PLATE_REFERENCE,
    RETEST,
    RUN,
    TICKED,
    TURNED,
    StepFacts,
    changed_codes,
    field_fault,
)
from tui.session.startup.progress import (
    StepRecord,
    progress_file,
    read_progress,
    start_up_lines,
)
from tui.session.startup.start_up import DEFICIENCY_STAYS, StartUp, begin_again, open_start_up
from tui.session.startup.steps import GuideField

LINE = "sim:atv71@1"
FAMILIES = ("atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca")


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path / "config"))


# Files


@pytest.mark.parametrize("family", FAMILIES)
def test_family_has_a_file_whose_parameters_its_profile_knows(family: str) -> None:
    profile = library.load(family)
    tables = tomli.loads((ROOT / "profiles" / "startup" / f"{family}.toml").read_text("utf-8"))
    codes = {parameter.code for parameter in profile.data.parameters}
    for table in tables["steps"]:
        named = [*table.get("parameters", ()), *table.get("plate", ()), *table.get("expect", ())]
        named += [table[key] for key in ("rated", "reverse") if key in table]
        assert set(named) <= codes, table["step"]
    guide = find_guide(profile)
    assert all(step.source and step.text and step.confidence for step in guide.steps)
    kinds = {step.kind for step in guide.steps}
    # what a start-up must have on each family, in a file that a person may edit
    assert {"identity", "settings", "direction", "stops", "loss", "backup", "report"} <= kinds
    assert ("save" in kinds) == (profile.data.memory.save is not None)
    steps = [step.step for step in guide.steps]
    known = {step.step for step in profile.data.start_up if step.parameters and not step.action}
    assert known - {"Commands", "Phase rotation"} <= set(steps)  # covered by other steps
    assert steps.index("Emergency stop") < steps.index("Direction")
    assert steps.index("Insulation") < steps.index("Direction")


def edited(tmp_path: Path, change: Callable[[str], str]) -> Path:
    text = (ROOT / "profiles" / "startup" / "atv71.toml").read_text("utf-8")
    changed = change(text)
    assert changed != text
    path = tmp_path / "own.toml"
    path.write_text(changed, "utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('profile = "atv71"', 'profile = "atv31"', ":4: the file is for 'atv31', not for atv71."),
        ('plate = ["INV"]', 'plate = ["INX"]', "'INX' is not a parameter of"),
        ('plate = ["INV"]', 'plate = ["PHR"]', "PHR is not a number"),
        ('plate = ["INV"]', 'plate = ["NPR"]', "the scale of NPR is unknown"),
        ('reverse = "PHR"', 'reverse = "ACC"', "ACC does not have exactly two values"),
        ('reverse = "PHR"\n', "", "name `reverse` or `remedy`"),
        ('"quick-stop"', '"fast-stop"', "'fast-stop' is not a stop of"),
        ('kind = "speeds"', 'kind = "speed"', "'speed'"),
        ('step = "Interlocks"', 'step = "Insulation"', "there are two steps 'Insulation'"),
        ('from_profile = "Macro"', 'from_profile = "Makro"', "'Makro' is not a step of atv71"),
        ('from_profile = "Macro"\n', "", "`text` is missing"),
        ('least = "Lowest allowed"', 'least = "Lowest"', "must be number fields"),
        ("hz = [10.0, 25.0, 50.0]", "hz = [10.0, -5.0]", "hz"),
        ("hz = [5.0]", "hz = [5.0, 6.0]", "a direction check has one reference"),
        ("[startup]", "[startup", "not valid TOML"),
        ('kind = "save"', 'kind = "save"\nsurprise = 1', "surprise"),
    ],
)
def test_fault_of_a_file_names_its_line(tmp_path: Path, old: str, new: str, fault: str) -> None:
    path = edited(tmp_path, lambda text: text.replace(old, new, 1))
    with pytest.raises(ProfileError) as refused:
        read_guide(path, library.load("atv71"))
    assert fault in str(refused.value)
    first = str(refused.value).splitlines()[0]
    assert first.startswith(f"{path}:")
    assert first.removeprefix(f"{path}:")[0].isdigit()


def test_missing_or_unreadable_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="cannot be read"):
        read_guide(tmp_path / "none.toml", library.load("atv71"))
    (tmp_path / "odd.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ProfileError, match="UTF-8"):
        read_guide(tmp_path / "odd.toml", library.load("atv71"))


def test_file_of_the_user_replaces_the_packaged_one(tmp_path: Path) -> None:
    path = edited(tmp_path, lambda text: text.replace("[startup]", '[startup]\ntitle = "Pump"', 1))
    own = tmp_path / "config" / "profiles" / "startup" / "atv71.toml"
    own.parent.mkdir(parents=True)
    path.rename(own)
    assert find_guide(library.load("atv71")).title == "Pump"


# Results


def begun() -> StartUp:
    return open_start_up(DriveSession(FakeLine(), 1, library.load("atv71")), LINE)


def go_to(made: StartUp, step: str) -> StartUp:
    made.go([s.step for s in made.guide.steps].index(step) - made.index)
    assert made.step.step == step
    return made


def facts(made: StartUp, raws: dict[str, int] | None = None, **other: object) -> StepFacts:
    known = StepFacts(made.session.profile, raws or {}, (), (), (), at_rest=True, identity="")
    return known._replace(**other)  # type: ignore[arg-type]


def record(made: StartUp, **entries: str) -> None:
    for key, text in entries.items():
        made.enter(key.replace("_", " "), text)


INSULATION = {
    "Motor_cable_disconnected_from_the_drive": TICKED,
    "Instrument": "MIT430",
    "Test_voltage": "500",
    "Insulation_resistance": "3.5",
    "Motor_cable_connected_again": TICKED,
    "Name": "Ada",
}


def test_insulation_is_judged_only_by_a_typed_limit() -> None:
    made = go_to(begun(), "Insulation")
    assert "not recorded" in made.finish(facts(made))
    record(made, **INSULATION)
    assert made.finish(facts(made)) == ""
    made.enter("Lowest allowed", "5")
    assert made.record.state == "open"
    assert "3.5 megohm is below the typed limit of 5 megohm" in made.finish(facts(made))
    made.enter("Lowest allowed", "1")
    assert made.finish(facts(made)) == ""
    made.enter("Motor cable disconnected from the drive", "no")
    assert "is not ticked" in made.finish(facts(made))


@pytest.mark.parametrize("text", ["", "abc", "-1", "nan", "inf", "1e999999999", "1;2"])
def test_number_that_is_none_is_not_recorded(text: str) -> None:
    assert field_fault(GuideField(name="Voltage", kind="number"), text)
    assert not field_fault(GuideField(name="Voltage", kind="number"), "12,5")


def test_deficiency_stays_open_until_tested_again() -> None:
    made = go_to(begun(), "Insulation")
    record(made, **INSULATION)
    made.note_deficiency("wet cable")
    assert made.skip("no time") == DEFICIENCY_STAYS
    assert made.record.state == "deficient"
    assert made.record.entries == {}
    record(made, **INSULATION)
    assert made.record.state == "deficient"
    assert "Tested again is not recorded" in made.finish(facts(made))
    made.enter(RETEST, "new cable")
    assert made.finish(facts(made)) == ""
    assert made.progress.steps["Insulation"].state == "done"
    assert "wet cable" in made.record.past[0]
    assert "3.5" in made.record.past[0]


def test_next_step_is_the_next_that_is_open_or_deficient() -> None:
    made = begun()
    steps = [step.step for step in made.guide.steps]
    here = steps.index(made.step.step)
    for place in (1, 2):
        made.progress.steps[steps[here + place]] = StepRecord(state="skipped")
    made.go_on()
    assert made.step.step == steps[here + 3]
    made.progress.steps.update((step, StepRecord(state="done")) for step in steps)
    made.go_on()
    assert made.step.step == steps[here + 3]
    made.progress.steps[steps[1]] = StepRecord(state="deficient")
    made.go_on()
    assert made.step.step == steps[1]


def test_settings_are_done_only_if_read_and_written() -> None:
    made = go_to(begun(), "Ramps")
    raws = {"INR": 1, "ACC": 30, "DEC": 30}
    assert "has not been read" in made.finish(facts(made))
    assert "ACC is staged, not written" in made.finish(facts(made, raws, staged=("ACC",)))
    assert made.finish(facts(made, raws)) == ""
    assert changed_codes(made.step, made.record, raws) == []
    assert changed_codes(made.step, made.record, {**raws, "ACC": 20}) == ["ACC"]


def test_tuning_is_done_only_with_its_result() -> None:
    made = go_to(begun(), "Auto-tuning")
    assert "it must be" in made.finish(facts(made, {"TUN": 0, "TUS": 3}))
    assert made.finish(facts(made, {"TUN": 0, "TUS": 4})) == ""


def test_nameplate_that_differs_prevents_done() -> None:
    made = go_to(begun(), "Identity")
    made.enter(PLATE_REFERENCE, "ATV71HU15M3")
    made.enter("INV", "8.0")
    reported = facts(made, {"INV": 75}, identity="ATV71HU22M3")
    assert "the drive reports ATV71HU22M3" in made.finish(reported)
    same = reported._replace(identity="ATV71HU15M3 ATV71HU15M3, 1.5 kW")
    made.enter(PLATE_REFERENCE, "ATV71")
    assert "the drive reports" in made.finish(same)
    made.enter(PLATE_REFERENCE, "atv71 hu15m3 z")
    assert "the nameplate says 8.0, the drive has 7.5 A" in made.finish(same)
    made.enter("INV", "7,5")
    assert made.finish(same) == ""


def test_direction_is_done_only_as_required_and_at_standstill() -> None:
    made = go_to(begun(), "Direction")
    made.enter(RUN, "12:00:00")
    assert "not recorded that the motor turned" in made.finish(facts(made, {"PHR": 0}))
    made.enter(TURNED, AS_REQUIRED)
    assert "standstill" in made.finish(facts(made, {"PHR": 0}, at_rest=False))
    assert made.finish(facts(made, {"PHR": 0})) == ""


def test_unsaved_settings_prevent_the_save_step() -> None:
    made = go_to(begun(), "Save")
    assert "not saved" in made.finish(facts(made, unsaved=("ACC",)))
    assert made.finish(facts(made)) == ""


# On disk


def test_progress_is_resumed_at_its_step_with_what_has_changed() -> None:
    made = go_to(begun(), "Ramps")
    raws = {"INR": 1, "ACC": 30, "DEC": 30}
    made.take(raws, whole=True)
    assert made.finish(facts(made, raws)) == ""
    made.go(1)
    resumed = begun()
    assert resumed.step.step == "Speed range"
    assert resumed.resumed
    assert resumed.changes.needs_all
    resumed.take({**raws, "ACC": 50}, whole=False)  # a part of the values proves nothing
    assert resumed.changes.texts == ()
    assert resumed.changes.needs_all
    resumed.take({**raws, "ACC": 50}, whole=True)
    assert len(resumed.changes.texts) == 1
    assert resumed.changes.texts[0].startswith("ACC ")
    resumed.take({**raws, "ACC": 60}, whole=False)  # written from this panel
    assert len(resumed.changes.texts) == 1
    resumed.changes.lost()
    resumed.take({**raws, "ACC": 70}, whole=True)
    assert len(resumed.changes.texts) == 2


def test_other_drive_at_the_address_has_its_own_progress() -> None:
    from tui.session.connect.identify import DriveIdentity

    def identity(reference: str) -> DriveIdentity:
        return DriveIdentity(1, "", reference, "", "", None, ())

    line, profile = FakeLine(), library.load("atv71")
    files = {
        progress_file(DriveSession(line, 1, profile, identity(r)), LINE) for r in ("A", "B/../C")
    }
    files.add(progress_file(DriveSession(line, 2, profile, identity("A")), LINE))
    assert len(files) == 3
    assert len({file.parent for file in files}) == 1


def test_start_up_that_begins_again_keeps_its_results_in_another_file() -> None:
    first, beside = begun(), begun()
    first.skip("not needed")
    time.sleep(0.002)  # a start-up is known by its begin, in ms
    first = begin_again(first, LINE)
    assert first.counts()["skipped"] == 0
    file = progress_file(first.session, LINE)
    assert not file.exists()
    past = json.loads(file.with_suffix(".past").read_text("utf-8"))
    assert past["steps"][first.step.step]["text"] == "not needed"
    first.skip("of the next drive")
    beside.skip("of the first drive")  # of a panel that does not know of the next one
    assert "NOT SAVED: another program has begun this start-up again." in beside.trouble
    assert begun().record.text == "of the next drive"


def test_damaged_progress_is_kept_aside() -> None:
    made = go_to(begun(), "Ramps")
    file = progress_file(made.session, LINE)
    times = ({"begun": 1}, {"begun": "x", "drive": ""}, {"begun": "", "drive": ""})
    for damaged in ("{", *map(json.dumps, times)):
        file.write_text(damaged, "utf-8")
        again = begun()
        assert "damaged" in again.notice
        assert again.index == 0
        again.go(3)
    assert sorted(path.suffix for path in file.parent.iterdir()) == [
        ".damaged", ".damaged2", ".damaged3", ".damaged4", ".json",
    ]  # fmt: skip
    assert (file.with_suffix(".damaged")).read_text("utf-8") == "{"


def test_full_disk_is_reported_and_the_results_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    made = begun()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(start_up, "save_progress", full)
        go_to(made, "Insulation").enter("Name", "Ada")
        assert "NOT SAVED: No space left on device" in made.trouble
    made.enter("Instrument", "MIT430")
    stored = read_progress(progress_file(made.session, LINE))
    assert made.trouble == ""
    assert stored is not None
    assert stored.steps["Insulation"].entries == {"Name": "Ada", "Instrument": "MIT430"}


def test_newer_result_of_another_program_is_kept() -> None:
    made = go_to(begun(), "Insulation")
    other = begun()
    go_to(other, "Interlocks").enter("Name", "Bob")
    made.enter("Name", "Ada")
    stored = read_progress(progress_file(made.session, LINE))
    assert stored is not None
    assert stored.steps["Interlocks"].entries == {"Name": "Bob"}
    assert stored.steps["Insulation"].entries == {"Name": "Ada"}


def test_report_has_each_result_and_former_deficiencies() -> None:
    made = go_to(begun(), "Insulation")
    assert start_up_lines(made.session, LINE) == []
    record(made, **INSULATION)
    made.note_deficiency("wet cable")
    go_to(made, "Auto-tuning").skip("load is coupled")
    text = "\n".join(start_up_lines(made.session, LINE))
    assert "Insulation: DEFICIENT: wet cable" in text
    assert "Auto-tuning: skipped: load is coupled" in text


# Evidence


def trend(*values: tuple[float, float | None, float | None]) -> list[TrendPoint]:
    return [TrendPoint(time, (hertz, amperes, None)) for time, hertz, amperes in values]


RAN = trend(
    (0, 0, 0), (1, 5, 3), (2, 10, 2), (3, 10, 2), (4, 10.2, 2), (5, 10, 2),
    (6, 5, 1), (7, 0, 0), (8, 0, 0),
)  # fmt: skip


def test_run_speed_and_stop_are_found_in_the_trend() -> None:
    run, steady, stop = last_run(RAN, -1), last_steady(RAN, 10, -1), last_stop(RAN, -1)
    assert run is not None
    assert run.time == 6
    assert steady is not None
    assert steady.current == 2
    assert steady.end == 5
    assert stop is not None
    assert (stop.end, stop.hertz, stop.seconds) == (7, 10.2, 2)


def test_run_before_the_step_was_due_is_no_evidence() -> None:
    assert last_run(RAN, 7) is None
    assert last_run(RAN, 3) is None  # it began before
    assert last_steady(RAN, 10, 4) is None
    assert last_stop(RAN, 7) is None
    assert last_steady(RAN, 20, -1) is None


def test_motor_that_turns_has_not_stopped() -> None:
    assert last_stop(RAN[:6], -1) is None
    assert last_run([TrendPoint(1, (None, None, None), "start")], 0) is not None
    assert last_run([TrendPoint(1, (None, None, None))], 0) is None
