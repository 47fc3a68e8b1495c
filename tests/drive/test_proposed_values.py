"""Values of a profile that it proposes to write, compared with what their parameter can hold."""

from __future__ import annotations

from typing import Any

import pytest

from tests.session.fakes import parameter, profile_of
from tui.drive.profile.new_file import _written
from tui.drive.profile.rules.limits import _proposed


@pytest.mark.parametrize("bit", [True, False])
def test_whole_word_of_a_memory_command_is_compared_and_a_bit_is_not(bit: bool) -> None:
    order: dict[str, Any] = {"parameter": "SAV", "raw": 2, "bit": bit, "does": "It saves."}
    profile = profile_of(parameter("SAV", 1), memory={"save": order, "factory": order})
    found = [each for each in _proposed(profile.data) if each[0][0] == "memory"]
    places = [("memory", name, "raw") for name in ("save", "factory")]
    assert found == ([] if bit else [(place, "SAV", 2) for place in places])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"), (False, "false"), (-5, "-5"), ("a", '"a"'), ([], "[]"), ([1, 2], "[1, 2]"),
        ({"a": 1, "b c": 2}, '{ a = 1, "b c" = 2 }'), ([{"a": 1}], "[\n  { a = 1 },\n]"),
        (0.5, "0.5"),
    ],
)  # fmt: skip
def test_value_of_a_new_profile_is_written_as_toml(value: object, text: str) -> None:
    assert _written(value) == text
