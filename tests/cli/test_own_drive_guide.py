"""docs/own-drive.md leads from a table to a simulated motor that runs; tables with mistakes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tests.session.test_command import bench
from tui.drive.errors import ProfileError
from tui.drive.profile import library
from tui.drive.profile.address_rule import fill_addresses
from tui.drive.profile.csv_file import profile_from_table

from .commands import ended

GUIDE = (Path(__file__).parents[2] / "docs" / "own-drive.md").read_text("utf-8")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL)


async def test_guide_leads_from_the_table_to_a_motor_that_runs(tmp_path: Path) -> None:
    table = tmp_path / "my-drive.csv"
    table.write_text(blocks("csv")[0], encoding="utf-8")
    commands, scale, frame = blocks("toml")
    begun = ended(0, "profiles", "new", "my-drive", "--from-csv", table)
    path = library.user_folder() / "my-drive.toml"
    assert str(path) in begun.stdout
    assert library.faults_of(path) == [], "valid from the first moment"
    text = path.read_text("utf-8")
    text = text.replace('code = "REF"\n', f'code = "REF"\n{scale}')
    path.write_text(f"{text}\n{commands}\n{frame}", encoding="utf-8")
    library.load.cache_clear()
    ended(0, "profiles", "--check", path)
    ended(0, "profiles", "--prove", path)
    rows = {p.code: p for p in library.load("my-drive").parameters}
    assert (rows["FMAX"].max, rows["FMAX"].factory, rows["ACC"].min) == (1200, 500, 1)
    async with bench("my-drive") as made:
        made.commander.run("forward", "20Hz")
        assert await made.done() == "Run forward: Running"
        assert made.writes() == [(101, 4000), (100, 1)]
        await made.let_go_until(lambda: abs(made.drive.motor.frequency - 20) < 0.1)
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)


def test_hexadecimal_code_with_a_number_or_an_address_is_right() -> None:
    table = "code,name,number,address\nA8,Ramp,16#A8,\nF07,Top,7,\nB1,Word,,9\n1E,Low,,16#1E\n"
    text = profile_from_table(table, "own", "t.csv", "number - 1")
    tables = tomllib.loads(text)
    assert fill_addresses(tables) == []
    assert [row["address"] for row in tables["parameters"]] == [0xA7, 6, 9, 0x1E]


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ("code,name,limit\n", "t.csv:1: 'limit' is not a column."),
        ("code,unit\n", "t.csv:1: it needs the columns code and name."),
        ("code,name,min,minimum\n", "min occurs twice"),
        ("code,name\n\n", "it has no line with a parameter"),
        ("code,name,scale,max\nA,Ramp,0.1,1.25\n", "t.csv:2: A: max 1.25 is not a whole number"),
        ("code,name,max\nA,Ramp,ten\n", "t.csv:2: A: max 'ten' is not a number"),
        ("code,name,access\nA,Ramp,yes\n", "access 'yes' is not r, rw"),
        ("code;name;values\nA;Mode;Off\n", "values 'Off' is not written as 0=Off"),
        ("code,name\n,Ramp\n", "t.csv:2: a parameter needs a code and a name"),
        ("code,name,scale,max\nA,Ramp,0,1,50\n", "t.csv:2: it has more cells than the first line"),
        ("code,name,max\nA,Ramp,1e999999\n", "max '1e999999' is not a number"),
        ("code,name,max\nA,Ramp,inf\n", "max 'inf' is not a number"),
        (f"code,name\nA,{'x' * 200_000}\n", "t.csv:2: it is not a table"),
        ("code,name,function\nA,Ramp,5\n", "function '5' is not 1, 2, 3 or 4"),
        (
            "code,name\nA8,Ramp\n",
            "A8: this code may be hexadecimal. Give its number, such as 16#A8",
        ),
        ("code,name,address\n1f,Ramp,number - 1\n", "such as 16#1F or 1, or its address"),
        (
            "code,name\n2103H,Ramp\n",
            "2103H: this code may be hexadecimal. Give its number, such as 16#2103 or 2103",
        ),
        ("code,name,mask\nA,Ramp,all\n", "mask 'all' is not a number"),
    ],
)
def test_table_with_a_mistake_is_refused_at_its_line(table: str, reason: str) -> None:
    with pytest.raises(ProfileError, match=re.escape(reason)):
        profile_from_table(table, "own", "t.csv")


def test_table_of_a_spreadsheet_is_read(tmp_path: Path) -> None:
    """A byte order mark, semicolons, decimal commas, hexadecimal addresses, names of values."""
    table = tmp_path / "t.csv"
    table.write_text(
        "Parameter;Description;Register;Resolution;Maximum;Values;Access\r\n"
        "P1;Ramp;16#0101;0,1;12,5;;R/W\r\nP2;Mode;0102H;;;0=Off;rw\r\n"
        "P3;Sum;0x103;;;;\r\n",
        encoding="utf-8-sig",
    )
    ended(0, "profiles", "new", "own", "--from-csv", table)
    rows = {p.code: p for p in library.load("own").parameters}
    assert [rows[code].address for code in rows] == [0x101, 0x102, 0x103]
    assert (rows["P1"].scale, rows["P1"].max, rows["P1"].access) == ("0.1", 125, "rw")
    assert (dict(rows["P2"].values), rows["P3"].access) == ({"0": "Off"}, "r")
    ended(2, "profiles", "new", "own", "--from-csv", table)
    table.write_bytes("code,name\nA,Modèle\n".encode("latin-1"))
    refused = ended(2, "profiles", "new", "own2", "--from-csv", table)
    assert "t.csv:2: byte 16#E8 is not UTF-8" in refused.output


def test_pairs_and_parts_of_words_are_valid_from_the_first_moment(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text(
        "code,name,number,address,type,shift,mask,access,quantity\n"
        "STAT,Status,6,5,,,,r,status_word\nTRIP,Trip code,6.8,5,,8,16#FF,r,fault\n"
        "H,Hours,9,8,uint32,,,r,run_hours\n",
        encoding="utf-8",
    )
    ended(0, "profiles", "new", "pairs", "--from-csv", table)
    assert library.faults_of(library.user_folder() / "pairs.toml") == []
    assert library.load("pairs").parameters[1].shift == 8


def test_rule_for_addresses_is_written_once(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text(
        "code,name,number,address,type\nA,Ramp,3-41,,uint32\nB,Top,3-03,,\nC,Word,1,7,\n", "utf-8"
    )
    new = ("profiles", "new", "own", "--from-csv", table)
    ended(0, *new, "--address-rule", "10 * number - 1")
    path = library.user_folder() / "own.toml"
    rows = {p.code: p.address for p in library.load_file(path).parameters}
    assert rows == {"A": 3409, "B": 3029, "C": 7}
    text = path.read_text("utf-8")
    assert text.count("\naddress = ") == 2
    assert "\n# low_word_first = false\n" in text
    assert library.faults_of(path) == []
    refused = ended(2, *new[:2], "own2", *new[3:], "--address-rule", "number - 1000")
    assert "t.csv: A: 'number - 1000' gives -659 for 3-41" in refused.stderr


def test_missing_addresses_are_reported_once_with_the_rule(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text("code,name\nA,Ramp\nB,Top\nC,Word\n", "utf-8")
    ended(0, "profiles", "new", "own", "--from-csv", table)
    path = library.user_folder() / "own.toml"
    line = path.read_text("utf-8").splitlines().index("[[parameters]]") + 1
    assert library.faults_of(path) == [
        f"{path}:{line}: parameters.#1 (A): the field `address` is missing in 3 rows. Give"
        " each a number from 0 to 65535, or one rule for all as address of [profile], such as"
        " '10 * number - 1'."
    ]
