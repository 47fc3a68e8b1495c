"""Texts of drives, files and people as the commands print them: control characters are replaced."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.drive.test_add_a_drive import example
from tests.sweeps import kept
from tui.cli.documents.other_documents import CheckDocument
from tui.cli.shared.output import json_text
from tui.cli.shared.say import printable
from tui.drive.plain import commands
from tui.drive.profile import library
from tui.drive.settings.set_file import read_set
from tui.session.logs import stop_logging
from tui.simulator import DriveSpec, Simulation

from .commands import invoked, refused, run

NAME = "\x1b]0;x\x07[red]\n\x7f"
SHOWN = "␛]0;x␇[red]␊␡"


def tame(text: str) -> bool:
    """Return True if it has no control characters but line feeds."""
    return not any(commands(character) for character in text.replace("\n", ""))


@pytest.fixture
def line() -> Iterator[str]:
    """A drive with control characters in its name."""
    simulation = Simulation([DriveSpec("atv71", 1, identity={0: NAME, 2: NAME, 6: NAME})])
    simulation.start()
    host, port = simulation.serve_tcp()
    yield f"tcp:{host}:{port}"
    simulation.stop()


def test_drive_name_does_not_control_terminal(line: str) -> None:
    printed = run(0, "identify", line)
    assert tame(printed)
    assert f"Name       {SHOWN}\n" in printed
    text = run(0, "identify", line, "--json")
    assert tame(text)
    # scripts print it from the JSON on a terminal, too
    assert json.loads(text)["name"] == SHOWN


ESCAPED = json.dumps(NAME + "\x9b2J\u202e").replace("\x7f", "\\u007f")


@pytest.fixture
def evil(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A profile in which every name, note and unit of no motion commands the terminal."""
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    (tmp_path / "profiles").mkdir()
    whole = (library.packaged_folder() / "atv71.toml").read_text("utf-8")
    text = re.sub(r'^id = "atv71"$', 'id = "evil"', whole, flags=re.M)
    for key in ("name", "unit", "note", "summary", "group", "title", "does", "starts", "cause"):
        text = re.sub(
            # references, ramps and timeouts in no known unit are refused
            rf'(?<![\w]){key} = "(?!(?:k?Hz|s|ms|rpm|%|A|V|kW|Nm)")([^"\n]*)"',
            lambda m, key=key: f'{key} = {ESCAPED[:-1]}{m[1]}"',  # type: ignore[misc]
            text,
        )
    (tmp_path / "profiles" / "evil.toml").write_text(text, encoding="utf-8")
    library.load.cache_clear()
    faults = library.faults_of(tmp_path / "profiles" / "evil.toml")
    assert faults == []
    return "evil"


READING = {
    "identify": ("identify",),
    "status": ("status",),
    "status json": ("status", "--json"),
    "read": ("read", "ACC", "ETA", "LCR"),
    "read json": ("read", "ACC", "ETA", "LCR", "--json"),
    "watch": ("watch", "ACC", "ETA", "--count", "2", "--every", "0.05", "--csv", "out.csv"),
    "watch json": ("watch", "ACC", "--count", "2", "--every", "0.05", "--json"),
    "backup": ("backup", "out.toml"),
    "report": ("report", "out.md"),
    "block": ("block",),
    "save block": ("block", "save", "out-blocks.toml"),
    "write": ("write", "ACC=4.0", "--arm"),
    "write json": ("write", "CHCF=Separate", "--dry-run"),
    "stop": ("stop",),
    "reference": ("reference", "20", "--arm"),
    "too much": ("reference", "9999", "--arm"),
    "unknown": ("read", "\x1b[2J"),
}


@pytest.mark.parametrize("name", kept(READING, "status", "read json", "watch"))
@pytest.mark.sweep
def test_texts_of_drives_and_profiles_do_not_control_terminal(
    name: str, line: str, evil: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the terminal, in every file that is written, the journal and the log among them."""
    monkeypatch.chdir(tmp_path)
    command, *more = READING[name]
    done = invoked(command, line, *more, "-p", evil)
    assert done.exception is None or isinstance(done.exception, SystemExit), done.output
    assert "Traceback" not in done.output
    output = done.output + run(0, "journal") + run(0, "journal", "--json")
    assert tame(output), ascii(output)
    stop_logging()
    written = [path for path in tmp_path.rglob("*") if path.is_file() and "evil" not in path.name]
    for path in written:
        assert tame(path.read_text("utf-8").replace("\r", "")), path
    for argument in more:
        if argument.startswith("out"):
            assert tmp_path / argument in written


@pytest.mark.sweep
def test_backup_with_control_characters_is_read_back(line: str, evil: str, tmp_path: Path) -> None:
    path = tmp_path / "set.toml"
    run(0, "backup", line, path, "-p", evil)
    values = read_set(path)
    assert values.head.identity["name"] == SHOWN
    assert values.head.family.startswith(NAME)


def test_typed_name_does_not_control_terminal() -> None:
    for text, status in ((f"sim:{NAME}", 2), ("/dev/\x1b[2J", 3), ("sim:\udcff", 2)):
        assert tame(refused(status, "read", text, "ACC"))


def test_file_name_does_not_control_terminal(tmp_path: Path) -> None:
    bad = tmp_path / "\x1b[31m[red].toml"
    bad.write_text("format = 1\n[drive\n", "utf-8")
    output = refused(2, "compare", bad, "factory")
    assert tame(output)
    assert "␛[31m[red].toml" in output


def test_own_profile_does_not_control_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_json_escapes_control_characters_and_keeps_all() -> None:
    bad = "\x1b\x7f\x9b\u202e\u2028\udcff\U000e0001 é →"
    text = json_text(CheckDocument(file=bad, faults=[bad], hints=[]), compact=False)
    assert tame(text)
    assert "é →" in text
    written = {"schema": 1, "command": "profiles", "file": bad, "faults": [bad], "hints": []}
    assert json.loads(text) == written


def test_terminal_without_symbols_shows_question_mark() -> None:
    assert printable("a\x1b[2J → \n", "ascii") == "a?[2J ? \n"
    assert printable("a\x1b[2J →", "utf-8") == "a␛[2J →"
