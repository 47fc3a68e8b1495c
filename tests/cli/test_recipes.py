"""`drivepanel compare` of a whole line with its recipes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tui.bus.fake import FakeLine
from tui.cli.commands import backup
from tui.cli.shared.options import Target
from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead
from tui.drive.settings.recipes import split_sets
from tui.drive.settings.set_file import read_set
from tui.session.drive import DriveSession

from .commands import ended, refused, run, tcp_line
from .printed import forms_of

pytestmark = pytest.mark.long

SET = """[set]
format = 1
profile = "{profile}"
parameters = {count}

[parameters.x]
{rows}

[end]
parameters = {count}
"""
LIST = """format = 1
name = "Product A"

[[recipes]]
device = 4
profile = "atv312"
machine = "pumps.toml"
drive = "pump-4.toml"

[[recipes]]
device = 5
profile = "atv312"
machine = "pumps.toml"
ignore = ["dEC"]
"""


def written(path: Path, profile: str = "atv312", **raws: int) -> None:
    rows = "\n".join(f"{code} = {{ raw = {raw} }}" for code, raw in raws.items())
    path.write_text(SET.format(profile=profile, rows=rows, count=len(raws)), "utf-8")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    written(tmp_path / "pumps.toml", ACC=40, dEC=50, HSP=500, Add=9, Inr=1, nCr=30)
    written(tmp_path / "pump-4.toml", dEC=30)
    path = tmp_path / "hall2.toml"
    path.write_text(LIST, "utf-8")
    return path


@pytest.mark.parametrize("as_json", [False, True])
def test_each_drive_is_compared_with_its_own_recipe(as_json: bool, file: Path) -> None:
    sets = ("4:ACC=40", "4:dEC=30", "5:ACC=30", "5:HSP=450")
    options = [word for text in sets for word in ("--set", text)]
    with tcp_line("atv312@4", "atv312@5", *options, "--any-settings") as line:
        if as_json:
            done = ended(1, "compare", file, line, "--json")
            assert forms_of(done.stdout) == {"RecipesDocument"}
            document = json.loads(done.stdout)
            assert not document["equal"]
            assert [each["differs"] for each in document["drives"]] == [0, 2]
            assert document["name"] == "Product A"
            assert [row["code"] for row in document["drives"][1]["rows"]] == ["HSP", "ACC"]
            return
        output = run(1, "compare", file, line)
        assert "Drive 4: as its recipe of 4 settings." in output
        assert "Drive 5: differs in 2." in output
        assert "belongs to the set of a drive: nCr." in output
        assert "Add" not in output, "the address belongs to the line"
        assert run(0, "compare", file, line, "-d", "4").startswith("Product A:\nDrive 4: as its")


def test_drive_that_does_not_answer_hinders_no_other(file: Path) -> None:
    with tcp_line("atv312@5", "--set", "ACC=40", "--set", "HSP=500", "--any-settings") as line:
        done = ended(3, "compare", file, line)
    assert "Drive 4: not compared." in done.stdout
    assert "Drive 5: as its recipe of 3 settings." in done.stdout


def test_advice_for_a_drive_of_another_family_names_its_recipe(file: Path) -> None:
    with tcp_line("atv71@4", "atv312@5", "--any-settings") as line:
        output = run(3, "compare", file, line, "-d", "4")
    assert "correct the profile in the recipe of this drive" in output
    assert "-p" not in output.split("not compared.")[1]


FAULTS = {
    "twice": ("device = 5", "device = 4", "hall2.toml:10: device 4 has two recipes."),
    "no set": ('machine = "pumps.toml"\nignore', "ignore", "hall2.toml:10: name a set: machine,"),
    "code": ('["dEC"]', '["DEX"]', "hall2.toml:10: ignore: 'DEX' is not a parameter of Altivar"),
    "scale": (
        '"pumps.toml"\ndrive = "pump-4.toml"',
        '"pump-4.toml"',
        "hall2.toml:4: dEC depends on Inr, which is in no set",
    ),
    "gone": ('"pump-4.toml"', '"none.toml"', "none.toml: cannot be read"),
    "profile": ('"atv312"', '"atv313"', "atv313"),
    "family": ('"pump-4.toml"', '"other.toml"', "other.toml is a set of atv31, not of atv312."),
    "key": ("machine =", "machines =", "machines"),
    "address": ("device = 5", "device = 300", "must be <= 247, not 300"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_of_a_recipe_is_reported_with_its_line(name: str, file: Path) -> None:
    before, after, expected = FAULTS[name]
    written(file.parent / "other.toml", "atv31", ACC=30)
    file.write_text(LIST.replace(before, after, 1), "utf-8")
    assert expected in " ".join(refused(2, "compare", file, "serial:/dev/none").split())


def test_options_that_do_not_fit_recipes_are_refused(file: Path) -> None:
    assert "omit -p" in refused(2, "compare", file, "sim:atv312", "-p", "atv312")
    assert "no recipe for device 9" in refused(2, "compare", file, "sim:atv312", "-d", "9")


def test_recipes_are_restored_to_their_own_drives(file: Path) -> None:
    sets = ("4:ACC=40", "4:dEC=31", "5:dEC=77", "5:HSP=450")
    options = [word for text in sets for word in ("--set", text)]
    with tcp_line("atv312@4", "atv312@5", *options, "--any-settings") as line:
        before = {device: held_words(line, device) for device in "45"}
        shown = run(0, "restore", line, file, "--dry-run")
        assert before == {device: held_words(line, device) for device in "45"}
        assert "left out, of a drive: nCr" in shown
        documents = json.loads(run(0, "restore", line, file, "--arm", "--json"))
        written_codes = [[each["code"] for each in found["results"]] for found in documents]
        assert written_codes == [["dEC"], ["HSP", "ACC"]]
        after = {device: held_words(line, device) for device in "45"}
    assert after["4"] == {**before["4"], "dEC": 30}
    assert after["5"] == {**before["5"], "HSP": 500, "ACC": 40}, "dEC is ignored"


def held_words(line: str, device: str) -> dict[str, int]:
    """Settings of a drive that the recipes concern, and some that they must not touch."""
    read = run(0, "read", line, "ACC", "dEC", "HSP", "nCr", "Add", "-d", device, "--json")
    return {code: value["raw"] for code, value in json.loads(read)["values"].items()}


def test_recipes_are_restored_to_chosen_drives_only(file: Path) -> None:
    assert "no recipe for device 9" in refused(2, "restore", "sim:atv312", file, "-d", "9", "--arm")
    words = ("restore", "sim:atv312", file, "--arm", "-p", "atv312")
    assert "omit -p" in refused(2, *words)


@pytest.mark.sweep
def test_recipes_are_made_from_the_drives_of_a_line(tmp_path: Path) -> None:
    file = tmp_path / "hall.toml"
    sets = ("4:ACC=40", "5:ACC=55", "4:HSP=450", "5:HSP=450", "4:nCr=41", "5:nCr=41")
    options = [word for text in sets for word in ("--set", text)]
    with tcp_line("atv312@4", "atv312@5", "atv71@6", *options, "--any-settings") as line:
        devices = ("-d", "4", "-d", "5", "-d", "6")
        output = run(0, "backup", line, file, "--recipe", *devices)
        assert "recipes of 3 drives.\n" in output
        assert "hall-atv312.toml: 2 drives of Altivar 312 share " in output
        assert "hall-atv71.toml" not in output
        output = run(0, "compare", file, line)
        assert output.count("as its recipe of") == 3
        run(0, "write", line, "dEC=9", "-d", "5", "--arm")
        assert "Drive 5: differs in 1." in run(1, "compare", file, line)
        assert "already exists" in refused(2, "backup", line, file, "--recipe", *devices)
    machine, drive = (read_set(tmp_path / f"hall-{name}.toml").raws for name in ("atv312", "5"))
    assert machine["HSP"] == 450
    assert drive["ACC"] == 55
    assert {"ACC", "nCr", "Add"} <= drive.keys()
    assert not machine.keys() & drive.keys()


def test_document_of_a_recipe_is_about_each_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    values = {1: {"HSP": 500, "ACC": 30}, 2: {"HSP": 500, "ACC": 40, "nCr": 41}}
    absent = {1: {"SP9": "refused"}, 2: {}}

    def drives_read(target: Target) -> list[tuple[DriveSession, ParameterSet]]:
        sessions = [DriveSession(FakeLine(), device, profile) for device in (1, 2)]
        sets = [ParameterSet(SetHead("atv312", device=n), values[n], absent[n]) for n in (1, 2)]
        return list(zip(sessions, sets, strict=True))

    profile = library.load("atv312")
    monkeypatch.setattr(backup, "_drives_read", drives_read)
    words = ("backup", "sim:atv312", tmp_path / "x.toml", "--recipe", "-d", "1", "-d", "2")
    done = ended(4, *words, "--json")
    assert [
        (each["device"], each["file"], each["parameters"], each["absent"], each["all"])
        for each in json.loads(done.stdout)
    ] == [
        (1, str(tmp_path / "x-1.toml"), 1, {"SP9": "refused"}, False),
        (2, str(tmp_path / "x-2.toml"), 2, {}, False),
    ]
    files = {(each["recipe"], each["machine"]) for each in json.loads(done.stdout)}
    assert files == {(str(tmp_path / "x.toml"), str(tmp_path / "x-atv312.toml"))}


def test_values_on_different_scales_are_not_shared() -> None:
    profile = library.load("atv312")
    sets = [
        ParameterSet(SetHead("atv312", device=device), {"Inr": inr, "ACC": 30, "HSP": 500})
        for device, inr in ((4, 1), (5, 0))
    ]
    machine, rest = split_sets(profile, sets)
    assert machine.raws == {"HSP": 500}
    assert [each.raws for each in rest] == [{"Inr": 1, "ACC": 30}, {"Inr": 0, "ACC": 30}]


def test_scale_of_an_own_setting_is_beside_it() -> None:
    profile = library.load("atv312")
    sets = [
        ParameterSet(
            SetHead("atv312", device=device), {"Inr": 1, "ACC": acc, "dEC": 30, "HSP": 500}
        )
        for device, acc in ((4, 30), (5, 55))
    ]
    machine, rest = split_sets(profile, sets)
    assert machine.raws == {"HSP": 500}
    assert rest[1].raws == {"Inr": 1, "ACC": 55, "dEC": 30}


def test_backup_of_several_drives_needs_recipes(tmp_path: Path) -> None:
    file = tmp_path / "new.toml"
    words = ("backup", "sim:atv312", file)
    assert "require --recipe" in refused_usage(*words, "-d", "1", "-d", "2")
    assert "neither --all" in refused_usage(*words, "--recipe", "--all")
    assert not file.exists()


def refused_usage(*words: str | Path) -> str:
    """Standard error of words that do not go together."""
    return ended(2, *words).stderr
