"""Commands on a line that swaps the two bytes of each word: reported, refused, stopped."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from .commands import ended, invoked, tcp_line

TEXT = "The bytes of each word of device 2 arrive swapped"


@pytest.fixture
def line() -> Iterator[str]:
    """An Altivar 71 at address 2 behind a gateway that swaps bytes."""
    with tcp_line("atv71@2", "--line-fault", "swapped=1") as text:
        yield text


@pytest.mark.parametrize(
    "words",
    [
        ("read", "HSP", "ETA"),
        ("status",),
        ("backup", "set.toml"),
        ("report", "report.txt"),
    ],
)
def test_values_with_swapped_bytes_are_not_shown(
    line: str, words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command, *rest = words
    text = ended(3, command, line, *rest, "-d", "2").stderr
    assert TEXT in text
    assert "byte order setting of the gateway or converter" in text
    assert not [*tmp_path.glob("set.*"), *tmp_path.glob("report.*")]


@pytest.mark.parametrize(
    "words",
    [
        ("reference", "30"),
        ("write", "ACC=5"),
        ("reset",),
    ],
)
def test_swapped_bytes_refuse_commands_and_settings(line: str, words: tuple[str, ...]) -> None:
    command, *rest = words
    assert TEXT in ended(3, command, line, *rest, "-d", "2", "--arm").stderr
    assert "The journal is empty" in ended(0, "journal").stdout


def test_swapped_bytes_refuse_a_run(line: str) -> None:
    words = ("run", line, "-d", "2", "--reference", "30Hz", "--arm")
    done = subprocess.run(
        [sys.executable, "-m", "tui", *words], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 3, done.stderr
    assert TEXT in done.stderr
    assert "The journal is empty" in ended(0, "journal").stdout


def test_stop_with_swapped_bytes_is_sent_but_not_reported_as_done(line: str) -> None:
    done = invoked("stop", line, "-d", "2")
    assert done.exit_code not in (0, 5)
    assert "NOT STOPPED" in done.output
    assert TEXT in done.output
    text = ended(0, "journal").stdout
    assert "CMD" in text


def test_watch_json_marks_values_with_swapped_bytes(line: str) -> None:
    done = invoked("watch", line, "-d", "2", "--json", "--count", "2")
    rows = [json.loads(row) for row in done.stdout.splitlines()]
    cycles = [item for item in rows if "values" in item]
    assert cycles
    for cycle in cycles:
        assert TEXT in cycle["error"]
        assert cycle["contact"] == "swapped"
        assert {value["quality"] for value in cycle["values"].values()} == {"bad"}
