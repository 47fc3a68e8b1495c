"""A part of the benchmark `hostile`: files, state and replies with random damage."""

from __future__ import annotations

import logging
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.hostile_cases import CASES, mutated, no_commands

ROUNDS = {"profiles": 40, "sets": 60, "blocks": 100, "state": 150, "replies": 400}
SEED = 7


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    """Damaged files are logged, one by one."""
    logging.disable()
    yield
    logging.disable(logging.NOTSET)


def test_every_kind_of_case_is_run() -> None:
    assert set(ROUNDS) == set(CASES)


@pytest.mark.parametrize("kind", ROUNDS)
def test_damaged_input_ends_in_a_sentence(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`python -m benchmarks.hostile` runs 10 000 of these; the number of a case is its seed."""
    # the cases name state folders of their own
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path))
    for number in range(ROUNDS[kind]):
        folder = tmp_path / str(number)
        folder.mkdir()
        try:
            CASES[kind](random.Random(f"{SEED} {kind} {number}"), folder)
        except Exception as error:
            raise AssertionError(f"{kind} {number} of seed {SEED}") from error


def test_mutations_change_the_text() -> None:
    text = b'[a]\nname = "x"\nraw = 3\n' * 5
    chance = random.Random(1)
    same = [mutated(text, chance) == text for _ in range(200)]
    assert sum(same) < 20


def test_control_characters_fail_the_check() -> None:
    no_commands("plain\n")
    with pytest.raises(AssertionError):
        no_commands("\x9b2J")
