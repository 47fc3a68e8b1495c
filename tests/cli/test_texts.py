"""What drives, files and people write, as the commands print it: text, with signs for controls."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.drive.test_add_a_drive import example
from tui.cli.shared.output import json_text
from tui.cli.shared.say import printable
from tui.drive.plain import commands
from tui.drive.profile import library
from tui.simulator import DriveSpec, Simulation

from .commands import invoked, refused, run

NAME = "\x1b]0;x\x07[red]\n\x7f"
SHOWN = "␛]0;x␇[red]␊␡"


def tame(text: str) -> bool:
    """Whether nothing in it commands a terminal but line feeds."""
    return not any(commands(character) for character in text.replace("\n", ""))


@pytest.fixture
def line() -> Iterator[str]:
    """A drive that calls itself what no drive should."""
    simulation = Simulation([DriveSpec("atv71", 1, identity={0: NAME, 2: NAME, 6: NAME})])
    simulation.start()
    host, port = simulation.serve_tcp()
    yield f"tcp:{host}:{port}"
    simulation.stop()


def test_a_drives_name(line: str) -> None:
    printed = run(0, "identify", line)
    assert tame(printed)
    assert f"Name       {SHOWN}\n" in printed
    text = run(0, "identify", line, "--json")
    assert tame(text)
    assert json.loads(text)["name"] == NAME


def test_a_name_in_a_command_line() -> None:
    for text, status in ((f"sim:{NAME}", 2), ("/dev/\x1b[2J", 3), ("sim:\udcff", 2)):
        assert tame(refused(status, "read", text, "ACC"))


def test_a_name_of_a_file(tmp_path: Path) -> None:
    bad = tmp_path / "\x1b[31m[red].toml"
    bad.write_text("format = 1\n[drive\n", "utf-8")
    said = refused(2, "compare", bad, "factory")
    assert tame(said)
    assert "␛[31m[red].toml" in said


def test_a_profile_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    (tmp_path / "profiles").mkdir()
    name = json.dumps(f"[/] {NAME}").replace("\x7f", "\\u007f")
    text = example().replace('"Example pump drive"', name).replace('"Level"', '"[/red]"')
    (tmp_path / "profiles" / "pump.toml").write_text(text, encoding="utf-8")
    library.load.cache_clear()  # another test may have read one of this id
    for arguments in (["profiles"], ["profiles", "example-pump"]):
        done = invoked(*arguments)
        assert done.exit_code == 0, done.output
        assert tame(done.output)
    assert f"[/] {SHOWN}"[:8] in done.output


def test_json_keeps_every_character_and_gives_a_terminal_none_of_the_bad_ones() -> None:
    data = {"a": "\x1b\x7f\x9b\u202e\u2028\udcff\U000e0001 é →", "b": [1, None]}
    text = json_text(data, compact=False)
    assert tame(text)
    assert "é →" in text
    assert json.loads(text) == data


def test_where_there_are_no_signs_a_question_mark_stands() -> None:
    assert printable("a\x1b[2J → \n", "ascii") == "a?[2J ? \n"
    assert printable("a\x1b[2J →", "utf-8") == "a␛[2J →"
