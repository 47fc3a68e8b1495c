"""Bands of Trend, remembered for each line."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ..paths import state_folder
from ..stored import store_json, stored_json

LINES_WITH_BANDS = 50
MOST_BANDS = 4


class TrendBand(NamedTuple):
    """One parameter of one drive."""

    device: int
    code: str


def stored_bands(line: str) -> list[TrendBand]:
    """Return the bands of a line (its key); empty if none are stored, or the file is damaged."""
    found = []
    reported = _all().get(line)
    for item in reported if isinstance(reported, list) else []:
        match item:
            case [int(device), str(code)] if 0 < device < 256:
                found.append(TrendBand(device, code))
    return found[:MOST_BANDS]


def store_bands(line: str, bands: Sequence[TrendBand]) -> None:
    """Remember the bands of a line; a folder that cannot be written is not an error."""
    others = {name: stored for name, stored in _all().items() if name != line}
    latest = {line: [list(band) for band in bands], **others}
    with suppress(OSError):
        store_json(_file(), dict(list(latest.items())[:LINES_WITH_BANDS]))


def _all() -> dict[str, object]:
    stored = stored_json(_file())
    return stored if isinstance(stored, dict) else {}


def _file() -> Path:
    return state_folder() / "trend.json"
