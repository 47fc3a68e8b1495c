"""Stop words of all families, known without decoding their profiles.

A stop of a drive whose family is unknown compares the words of all families. Loading all profiles
takes seconds on a small computer. So only the charts of a packaged file are parsed as TOML, and the
addresses of its parameters are found in its text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ..errors import ProfileError
from ..small_file import read_small_text
from ..words import is_word, word_count
from . import library
from .converting import converted
from .heads import section, shared_texts
from .profile import Profile
from .schema import Chart, Parameter

_ROW = re.compile(r"^\[\[parameters\]\][ \t]*\n", re.MULTILINE)
_CODE = re.compile(r"""^code = (["'])(.+)\1$""", re.MULTILINE)
_ADDRESS = re.compile(r"^address = (\d+)$", re.MULTILINE)
_TABLE = re.compile(r"^\[", re.MULTILINE)
_ODD = re.compile(r"^(?:function|mask|shift|type) = ", re.MULTILINE)
_BITS = re.compile(r"^function = [12]$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class StopProfile:
    """Charts of one family, and the addresses of the words that they use."""

    id: str
    name: str
    charts: tuple[Chart, ...]
    places: Mapping[str, int]
    """Place by code (wire_place), of whole registers that function 3 reads, and of single coils and
    inputs."""
    pairs: Mapping[str, Parameter]
    """Command words of 32 bits or of coils by code; no packaged family has one."""
    names_itself: bool
    """True if its drives support function 43; others do not answer reads of words that they
    lack."""

    @property
    def addresses(self) -> frozenset[int]:
        """Addresses of all words in `places`."""
        return frozenset(self.places.values())


def stop_profile() -> tuple[StopProfile, ...]:
    """Return the stop profiles of all families with a usable file, sorted by id."""
    found = (_facts(listing) for listing in library.listings() if not listing.fault)
    return tuple(profile for profile in found if profile is not None)


def _facts(listing: library.Listing) -> StopProfile | None:
    names_itself = library.mentions_function(listing, 43)
    if not listing.own and (quick := _quick(listing.path)) is not None:
        charts, places = quick
    else:
        try:
            profile = library.load_file(listing.path)
        except ProfileError:
            return None
        return stop_profile_of(profile, names_itself=names_itself)
    return StopProfile(listing.id, listing.name, charts, places, {}, names_itself)


def stop_profile_of(profile: Profile, *, names_itself: bool = True) -> StopProfile:
    """Return the stop profile of a loaded family."""
    places = {
        parameter.code: parameter.place
        for parameter in profile.parameters
        if parameter.function != 4
        and word_count(parameter) == 1
        and parameter.type.endswith("16")
        and parameter.mask == 0xFFFF
    }
    charts = tuple(profile.data.charts)
    codes = {order.parameter or chart.command for chart in charts for order in chart.orders}
    pairs = {code: profile[code] for code in codes if not is_word(profile[code])}
    return StopProfile(profile.id, profile.name, charts, places, pairs, names_itself)


def _quick(path: Path) -> tuple[tuple[Chart, ...], Mapping[str, int]] | None:
    """Return charts and addresses from a packaged file's text; None if it must be loaded."""
    try:
        text = read_small_text(path)
    except (OSError, UnicodeDecodeError):
        return None
    head, rows = section(text, "profile"), section(text, "charts")
    odd = '\naddress = "' in text or _BITS.search(text)
    if not isinstance(head, dict) or not rows or "without" in head or odd:
        return None
    shared = shared_texts(head, path.parent) if "rows_from" in head else []
    if shared is None or any("[[charts]]" in item for item in shared):
        return None
    try:
        charts: tuple[Chart, ...] = converted(rows, tuple[Chart, ...])
    except msgspec.ValidationError:
        return None
    places: dict[str, int] = {}
    for item in (*shared, text):
        places |= _places(item)
    return charts, places


def _places(text: str) -> dict[str, int]:
    found = {}
    for row in _ROW.split(text)[1:]:
        own = _TABLE.split(row, maxsplit=1)[0]
        code, address = _CODE.search(own), _ADDRESS.search(own)
        if code and address and not _ODD.search(own):
            found[code[2]] = int(address[1])
    return found
