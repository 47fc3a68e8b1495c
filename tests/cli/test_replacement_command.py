"""`drivepanel restore LINE newest`: the set of a predecessor, shown before anything is written."""

from __future__ import annotations

from pathlib import Path

import pytest

from .commands import refused, run, tcp_line

SETS = [word for code in ("ACC=55", "dEC=42", "HSP=450", "SP2=120") for word in ("--set", code)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present folder of a command, without files."""
    folder = tmp_path / "here"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


def test_set_of_a_predecessor_is_shown_then_written_by_its_own_command(folder: Path) -> None:
    with tcp_line("atv31@4", *SETS) as old:
        run(0, "backup", old, "old.toml", "-d", "4")
    with tcp_line("atv312@4") as line:
        shown = ("restore", line, "newest", "-d", "4", "--dry-run")
        assert "No backup of drive 4" in refused(2, *shown)
        file = folder / "old.toml"
        file.write_text(file.read_text("utf-8").replace(old, line), "utf-8")
        text = run(0, *shown)
        assert "Predecessor: Altivar 31, ATV31HU09M3S232" in text
        assert "Rating: the same model, another variant" in text
        assert "4 of 8 settings that the predecessor had changed" in text
        assert "write  ACC: 3.0 s -> 5.5 s" in text
        assert "leave  atv31 COd" in text
        assert "Source of the table" in text
        *_, writing, testing = text.splitlines()
        assert testing.strip() == f"drivepanel accept TEST.toml {line} -d 4 --arm"
        # the command that it names
        words = writing.split()[1:]
        assert words[0] == "restore"
        assert "Wrote 4, all verified" in run(0, *words)


def test_newest_set_is_never_written_unseen(folder: Path) -> None:
    text = refused(2, "restore", "sim:atv312", "newest", "--arm")
    assert "look at the differences first" in text


def test_file_with_the_name_newest_is_a_file(folder: Path) -> None:
    (folder / "newest").write_text("x", "utf-8")
    assert "newest:1:" in refused(2, "restore", "sim:atv312", "newest", "--arm")
