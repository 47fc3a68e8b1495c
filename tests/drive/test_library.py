"""Finding profiles, loading them strictly, and saying where a fault is."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import tomli
from click.testing import CliRunner

from tui.cli.main import main
from tui.drive.errors import ProfileError, UnknownParameter, UnknownProfile
from tui.drive.profile import heads, json_schema, library
from tui.drive.profile.profile import notations, parse_address

SMALL = """\
[profile]
id = "small"
name = "Small drive"
vendor = "Nobody"
version = "1"

[link]
baud = 19200
format = "8E1"

[[sources]]
id = "manual"
title = "A manual"

[[functions]]
code = 3
name = "Read"
max_read = 10

[monitoring]
values = [{ parameter = "FRQ" }]

[[parameters]]
code = "FRQ"
name = "Frequency"
number = "W100"
address = 100
unit = "Hz"
scale = "0.1"
access = "r"
group = "All"
source = "manual 1"
confidence = "manual"
"""


def write(tmp_path: Path, text: str | bytes) -> Path:
    file = tmp_path / "small.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def test_small_profile_loads(tmp_path: Path) -> None:
    profile = library.load_file(write(tmp_path, SMALL))
    assert profile["FRQ"].address == 100


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('unit = "Hz"', 'unit = "Hz"\ncolor = "red"', 29, "`color` is not a field"),
        ("address = 100", 'address = "100"', 27, "must be a whole number, not a text"),
        ("address = 100", "address = 70000", 27, "must be <= 65535"),
        ('scale = "0.1"', 'scale = "0,1"', 29, "wrong form"),
        ('scale = "0.1"', 'scale = "0.0"', 29, "scale must not be 0"),
        ('access = "r"', 'access = "x"', 30, "not an allowed value"),
        ('source = "manual 1"', 'source = "web"', 32, "does not begin with the id of a source"),
        ('{ parameter = "FRQ" }', '{ parameter = "CUR" }', 21, "no parameter 'CUR'"),
        ("code = 3\n", "code = 6\n", 15, "function 3 is missing"),
        ('vendor = "Nobody"\n', "", 1, "`vendor` is missing"),
        ('name = "Small drive"', 'name = "Small drive', 3, "not valid TOML"),
        ('group = "All"', 'group = "All"\nmin = 9\nmax = 3', 23, "above max"),
        ('group = "All"', 'group = "All"\nenumeration = "no"', 32, "no enumeration 'no'"),
    ],
)
def test_profile_error_is_reported_with_file_and_line(
    tmp_path: Path, old: str, new: str, line: int, words: str
) -> None:
    assert old in SMALL
    file = write(tmp_path, SMALL.replace(old, new))
    with pytest.raises(ProfileError) as caught:
        library.load_file(file)
    text = str(caught.value)
    assert text.startswith(str(file))
    assert words in text
    if "TOML" not in words:
        reported = int(text.removeprefix(f"{file}:").split(":")[0])
        assert reported == line, text


def test_two_parameters_with_one_address_are_refused(tmp_path: Path) -> None:
    again = SMALL[SMALL.index("[[parameters]]") :].replace("FRQ", "FR2")
    with pytest.raises(ProfileError, match="address 100 already belongs to FRQ"):
        library.load_file(write(tmp_path, SMALL + "\n" + again))


@pytest.mark.parametrize(
    ("family", "right", "wrong"),
    [
        ("atv21", "Modbus FA01", "Modbus FA07"),
        ("atv71", "Combined.", "Combined, as W8999 says."),
        ("powerdrive", "", "6.44"),
    ],
)
def test_control_source_with_an_unknown_word_is_refused(
    tmp_path: Path, family: str, right: str, wrong: str
) -> None:
    text = (library.packaged_folder() / f"{family}.toml").read_text("utf-8")
    if not right:  # a family without one
        way = f'command = {{ sources = ["{wrong}"] }}\nreference = {{ sources = ["Line"] }}'
        source = f'[[control_sources]]\nid = "one"\nname = "One"\n{way}\nsettings = []\n'
        text = text.replace("[[parameters]]", f"{source}\n[[parameters]]", 1)
    else:
        assert right in text
        text = text.replace(right, wrong)
    word = next(part for part in wrong.split() if part[-1].isdecimal())
    with pytest.raises(ProfileError, match=rf"there is no word {word}\."):
        library.load_file(write(tmp_path, text.encode()))


def test_binary_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="not UTF-8"):
        library.load_file(write(tmp_path, b"\xff\xfe\x00"))


def test_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="cannot be read"):
        library.load_file(tmp_path / "none.toml")


def test_unknown_profile_names_the_known_ones() -> None:
    with pytest.raises(UnknownProfile, match="atv71"):
        library.load("atv99")


def test_listing_reads_only_the_head(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    (tmp_path / "profiles").mkdir()
    (tmp_path / "profiles" / "broken.toml").write_text(
        '[profile]\nid = "broken"\nname = "B"\nvendor = "V"\nversion = "1"\n\n[link]\n!!!!\n'
    )
    found = {listing.id: listing for listing in library.listings()}
    assert found["broken"].own
    assert found["broken"].name == "B"
    with pytest.raises(ProfileError, match="not valid TOML"):
        library.load_file(found["broken"].path)


def test_listing_does_not_check_packaged_profiles() -> None:
    code = (
        "import sys; from tui.drive.profile import library; library.listings();"
        "late = ('tui.drive.profile.check', 'tui.drive.profile.shared_rows');"
        "print([m for m in late if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_own_profile_replaces_a_packaged_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    (tmp_path / "profiles").mkdir()
    text = SMALL.replace('"small"', '"atv31"')
    (tmp_path / "profiles" / "mine.toml").write_text(text)
    found = {listing.id: listing for listing in library.listings()}
    assert (found["atv31"].name, found["atv31"].own) == ("Small drive", True)


def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    folder = tmp_path / "profiles"
    folder.mkdir()
    return folder


def test_head_is_read_as_toml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = own_folder(tmp_path, monkeypatch)
    prefixes = "[identification]\nreference_prefixes = [\n  'SMALL',  # with a comment\n]\n\n[link]"
    text = SMALL.replace('"small"', "'small'").replace('"Small drive"', '"""Small "one\\""""')
    (folder / "any.toml").write_text(text.replace("[link]", prefixes))
    [own] = [listing for listing in library.listings() if listing.own]
    assert (own.id, own.name, own.parameters, own.fault) == ("small", 'Small "one"', 1, "")
    assert library.matching_profiles("SMALL-1") == ["small"]
    assert library.mentions_function(own, 3)
    assert not library.mentions_function(own, 43)


def test_broken_and_duplicate_profiles_are_marked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = own_folder(tmp_path, monkeypatch)
    (folder / "a.toml").write_text(SMALL)
    (folder / "b.toml").write_text(SMALL)
    (folder / "c.toml").write_text('[profile]\nid = "atv31"\nname = "Mine\n')
    (folder / "d.toml").write_text(SMALL.replace('"small"', '"range"').replace("100", "70000"))
    lines = CliRunner().invoke(main, ["profiles"]).output.splitlines()

    def reported(id: str) -> list[str]:
        return [line.split("  (")[-1] for line in lines if line.split()[0] == id]

    assert reported("small") == ["your own)", "not used, a.toml has the same id)"]
    [broken] = reported("c")
    assert broken.startswith("your own, broken: ")
    assert "c.toml:3: not valid TOML" in broken
    assert "must be <= 65535" in reported("range")[0]
    assert len(reported("atv31")) == 1


def test_profile_is_created_from_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = own_folder(tmp_path, monkeypatch)
    done = CliRunner().invoke(main, ["profiles", "new", "my-drive", "--from", "atv312"])
    assert done.exit_code == 0, done.output
    path = folder / "my-drive.toml"
    assert str(path) in done.output
    assert library.faults_of(path) == []
    begun, source = library.load_file(path), library.load("atv312")
    assert (begun.id, begun.parameters) == ("my-drive", source.parameters)
    assert begun.data.signal_paths == source.data.signal_paths
    assert begun.data.schematics == source.data.schematics
    assert begun.data.parts == source.data.parts
    assert library.matching_profiles("ATV312HU09M3") == ["atv312"], "the copy takes no drive over"
    text = path.read_text()
    assert "rows_from" not in text, "what it shares stands in a file of one's own"
    again = CliRunner().invoke(main, ["profiles", "new", "my-drive", "--from", "atv21"])
    assert again.exit_code == 2
    assert path.read_text() == text
    for words in (("new", "x"), ("new", "My Drive", "--from", "atv21"), ("new", "--from", "atv21")):
        assert CliRunner().invoke(main, ["profiles", *words]).exit_code == 2
    assert CliRunner().invoke(main, ["profiles", "path"]).output.strip() == str(folder)


@pytest.mark.parametrize("family", [item.id for item in library.listings()])
def test_shared_rows_are_stored_once(family: str) -> None:
    path = library.packaged_folder() / f"{family}.toml"
    tables = tomli.loads(path.read_text("utf-8"))
    names = tables["profile"].get("rows_from", [])
    texts = [(library.packaged_folder() / name).read_text("utf-8") for name in names]
    rows = {row["code"]: row for text in texts for row in tomli.loads(text).get("parameters", [])}
    again = [
        f"{row['code']}.{key}"
        for row in tables["parameters"]
        for key in row.keys() & rows.get(row["code"], {}).keys() - {"code"}
    ]
    assert again == []
    [listing] = [item for item in library.listings() if item.id == family]
    assert listing.parameters == len(library.load(family).parameters)
    assert family not in SHARING or len(rows) >= SHARING[family]


SHARING = {"atv31": 231, "atv312": 231, "powerdrive": 68, "proxidrive": 68, "varmeca": 68}


def test_schema_describes_every_field() -> None:
    schema = json.loads(CliRunner().invoke(main, ["profiles", "--schema"]).output)
    bare = [
        f"{table}.{field}"
        for table, part in schema["$defs"].items()
        for field, shape in part["properties"].items()
        if not shape.get("description")
    ]
    assert bare == []
    assert schema["$defs"]["Parameter"]["properties"]["shift"]["description"].startswith("Bits")


@pytest.mark.parametrize(
    ("text", "address"),
    [("W9001", 9001), ("w 9 001", 9001), ("16#2329", 9001), ("0x2329", 9001), ("9001", 9001),
     ("W99999", None), ("ACC", None), ("16#", None)],
)  # fmt: skip
def test_address_notations_are_parsed(text: str, address: int | None) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize(
    ("profile_id", "typed", "code"),
    [
        ("atv71", "acc", "ACC"),
        ("atv71", "W9001", "ACC"),
        ("atv71", "16#2329", "ACC"),
        ("atv71", "9001", "ACC"),
        ("atv21", "fd00", "FD00"),
        ("atv21", "16#fd00", "FD00"),
        ("atv21", "64768", "FD00"),
        ("atv21", "f875", "F875"),
        ("powerdrive", "1.05", "1.05"),
        ("powerdrive", "104", "1.05"),
        ("powerdrive", "10.40", "10.40"),
        ("atv312", "aCc", "ACC"),
    ],
)
def test_parameter_is_found_by_three_notations_in_any_case(
    profile_id: str, typed: str, code: str
) -> None:
    found = library.load(profile_id).find(typed)
    assert found.code == code
    assert notations(found)[0] == code


def test_unknown_code_suggests_similar_ones() -> None:
    with pytest.raises(UnknownParameter, match="ACC"):
        library.load("atv71").find("ACCC")


@pytest.mark.parametrize(
    ("reference", "profile_id"),
    [("ATV71HU15M3", "atv71"), ("atv21h075m3x", "atv21"), ("ATV31HU09M3S232", "atv31"),
     ("ATV312HU09M3", "atv312")],
)  # fmt: skip
def test_model_reference_finds_its_profile(reference: str, profile_id: str) -> None:
    assert library.matching_profiles(reference)[0] == profile_id


def test_unknown_model_reference_finds_none() -> None:
    assert library.matching_profiles("ACS550") == []


def test_committed_schema_is_up_to_date() -> None:
    committed = library.packaged_folder() / "profile.schema.json"
    assert committed.read_text(encoding="utf-8") == json_schema.schema_text()


def test_schema_refuses_unknown_fields() -> None:
    assert json_schema.profile_schema()["$defs"]["Parameter"]["additionalProperties"] is False


def test_texts_found_without_a_parser_are_those_of_the_head() -> None:
    for path, _ in library.profile_files():
        parsed = heads.quick_head(path, own=True).table
        texts = {key: value for key, value in parsed.items() if isinstance(value, str)}
        assert heads.quick_head(path, own=False).table == texts
        assert texts["id"] == path.stem
