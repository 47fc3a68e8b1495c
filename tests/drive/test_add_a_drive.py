"""A drive is added with one file and no code, as profiles/README.md teaches it."""

from __future__ import annotations

import re
from decimal import Decimal
from pathlib import Path
from typing import get_args

import msgspec
import pytest

from tui.drive.errors import ProfileError
from tui.drive.profile import library
from tui.drive.profile.schema import Confidence, Parameter, ProfileData
from tui.drive.settings.memory_orders import MemoryRefused, factory_order, save_order
from tui.drive.values import decode, encode

README = Path(__file__).parents[2] / "profiles" / "README.md"


def example() -> str:
    """The profile in the document: its one TOML block with a profile."""
    (found,) = re.findall(
        r"^```toml\n(\[profile\]\n.*?)^```$", README.read_text("utf-8"), re.M | re.S
    )
    return str(found)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The profile folder of a configuration folder that is the user's own."""
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    folder = tmp_path / "profiles"
    folder.mkdir()
    return folder


def test_example_profile_is_found_loaded_and_decodes(folder: Path) -> None:
    (folder / "my-pump.toml").write_text(example(), encoding="utf-8")
    (listing,) = [item for item in library.listings() if item.own]
    assert listing[:4] == ("example-pump", "Example pump drive", "Example", "1.0")
    assert listing.parameters == 9
    profile = library.load_file(listing.path)
    frequency = profile["FREQ"]
    assert decode(frequency, -503, {}, Decimal(frequency.scale)).display == "-50.3 Hz"
    mode = profile["MODE"]
    assert decode(mode, 2, profile.names(mode), Decimal(1)).text == "Level"
    ramp = profile.find("40201")
    assert encode(ramp, "3 s", {}, Decimal(ramp.scale)).raw == ramp.factory == 300
    assert save_order(profile).parameter == "KEEP"
    with pytest.raises(MemoryRefused, match="Example pump drive restores"):
        factory_order(profile)
    assert library.matching_profiles("EXPUMP-22") == ["example-pump"]


def test_packaged_profiles_stay_in_the_list(folder: Path) -> None:
    before = {item.id for item in library.listings()}
    (folder / "my-pump.toml").write_text(example(), encoding="utf-8")
    assert {item.id for item in library.listings()} == before | {"example-pump"}


def test_own_profile_replaces_a_packaged_one(folder: Path) -> None:
    text = example().replace('id = "example-pump"', 'id = "atv21"')
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    (listing,) = [item for item in library.listings() if item.id == "atv21"]
    assert listing.own
    assert listing.name == "Example pump drive"


BROKEN = [
    # old text, new text, expected message
    ('"Hz"\nscale = "0.1"\naccess', '"Hz"\nscale = "a tenth"\naccess', "FREQ"),
    ("address = 101", "address = 100", "already belongs to STAT"),
    ('source = "guide 5.2"', 'source = "a book"', "does not begin with the id of a source"),
    ('parameter = "TRIP", rate', 'parameter = "TRIPP", rate', "no parameter 'TRIPP'"),
    ('parameter = "KEEP"', 'parameter = "KEPT"', "no parameter 'KEPT'"),
    ('quantity = "acceleration"', 'quantity = "accelerate"', "RAMP"),
    ("max_read = 16", "max_read = 16\nmax_reed = 1", "max_reed"),
]


@pytest.mark.parametrize(("right", "wrong", "reported"), BROKEN)
def test_profile_error_is_reported_with_its_line(
    folder: Path, right: str, wrong: str, reported: str
) -> None:
    text = example()
    assert text.count(right) == 1
    path = folder / "my-pump.toml"
    path.write_text(text.replace(right, wrong), encoding="utf-8")
    with pytest.raises(ProfileError) as caught:
        library.load_file(path)
    assert reported in str(caught.value)
    assert re.search(r"my-pump\.toml:[1-9]\d*: ", str(caught.value))


def test_page_names_every_table_field_and_mark() -> None:
    text = README.read_text("utf-8")
    tables = [field.name for field in msgspec.structs.fields(ProfileData)]
    assert [t for t in tables if f"`[{t}]`" not in text and f"`[[{t}]]`" not in text] == []
    fields = [field.name for field in msgspec.structs.fields(Parameter)]
    assert [name for name in fields if f"`{name}`" not in text] == []
    assert [mark for mark in get_args(Confidence) if f"`{mark}`" not in text] == []


def test_page_names_every_packaged_profile() -> None:
    text = README.read_text("utf-8")
    files = sorted(path.name for path in library.packaged_folder().glob("*.toml"))
    assert files
    assert [name for name in files if f"`{name}`" not in text] == []
