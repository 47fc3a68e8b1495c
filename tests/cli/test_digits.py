"""A value of a long scale, 60/49152 Hz a count, as each command shows it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from tests.mixer import FINE, MIXER, installed_mixer

from .commands import run, tcp_line

LONG = "20.0012"
"""The beginning of the exact value, 20.0012207031250."""
TYPED = {
    "read": ("read", "REF"),
    "read, JSON": ("read", "REF", "--json"),
    "watch": ("watch", "REF", "--count", "1"),
    "watch, JSON": ("watch", "REF", "--count", "1", "--json"),
    "reference": ("reference", "20.001", "--arm"),
    "status": ("status",),
}


@pytest.mark.parametrize("words", TYPED.values(), ids=TYPED)
def test_no_command_shows_more_digits_than_the_scale(words: tuple[str, ...]) -> None:
    installed_mixer(FINE)
    with tcp_line(f"{MIXER}@1", "--set", "REF=16385") as line:
        shown = run(0, words[0], line, *words[1:], "-p", MIXER)
    assert LONG not in shown
    if words != TYPED["status"]:
        assert "20.001" in shown


def test_numbers_in_json_and_csv_equal_the_numbers_shown(tmp_path: Path) -> None:
    installed_mixer(FINE)
    with tcp_line(f"{MIXER}@1", "--set", "REF=16385") as line:
        found = json.loads(run(0, "read", line, "REF", "--json", "-p", MIXER))["values"]["REF"]
        kept = tmp_path / "kept.csv"
        run(0, "watch", line, "REF", "--count", "1", "--csv", kept, "-p", MIXER)
    assert (found["value"], found["text"], found["raw"]) == (20.001, "20.001", 16385)
    assert "20.001" in list(csv.reader(kept.read_text("utf-8").splitlines()))[-1]
