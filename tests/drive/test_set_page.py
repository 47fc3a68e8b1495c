"""The parameter set of docs/parameter-sets.md is valid, and means what the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tui.drive.profile import library
from tui.drive.settings.parameter_set import ABSENT, END_OF_SET, SET_HEADER, SetError, dump_set
from tui.drive.settings.set_file import load_set

PAGE = Path(__file__).resolve().parents[2] / "docs" / "parameter-sets.md"


def example() -> str:
    text, *_ = re.findall(r"^```toml\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    return str(text)


def test_page_example_is_a_valid_parameter_set() -> None:
    found = load_set(example(), "page.toml", library.load)
    assert found.raws == {"HSP": 500, "INR": 1, "ACC": 30, "DEC": 35}
    assert "exception 2" in found.absent["LAC"]
    assert found.head.identity["reference"] == "ATV71HU15M3"
    written = dump_set(library.load(found.head.profile), found)
    assert 'DEC = { raw = 35, value = "3.5 s", name = "Deceleration time" }' in written
    for line in example().splitlines():
        assert line in written or line.startswith("DEC"), line


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('raw = 500, value = "50.0 Hz"', 'raw = 500, value = "40.0 Hz"'),
        ("[end]\nparameters = 4\n", ""),
        ("[end]\nparameters = 4\n", "[end]\nparameters = 5\n"),
        ("format = 1\n", ""),
    ],
)
def test_page_lists_every_refusal(old: str, new: str) -> None:
    assert old in example()
    with pytest.raises(SetError, match=r"page\.toml"):
        load_set(example().replace(old, new), "page.toml", library.load)


def test_page_names_every_part() -> None:
    for part in (SET_HEADER, ABSENT, END_OF_SET, "identity"):
        assert f"| `[{part}]` |" in PAGE.read_text("utf-8")
