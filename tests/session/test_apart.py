"""Requested words of a drive that is silent at a word it does not have."""

from __future__ import annotations

from typing import Any

import pytest

from tui.bus.api import Reply
from tui.bus.errors import NoAnswer
from tui.drive.profile import library
from tui.session.drive import DriveSession
from tui.session.read.reader import Reader
from tui.session.read.retrying_reader import NO_SUCH_WORD, read_apart

from .fakes import OneDrive


class Lacking(OneDrive):
    """A drive of a family that is silent at words which it does not have."""

    def __init__(self, family: str, *codes: str) -> None:
        self.profile = library.load(family)
        super().__init__({parameter.address: 1 for parameter in self.profile.parameters})
        self.silent = {self.profile[code].address for code in codes}

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        if self.silent.intersection(range(address, address + count)):
            raise NoAnswer(device, 3, address)
        return await super().read(device, address, count, **how)


async def test_other_words_are_reported_and_the_unanswered_word_is_named() -> None:
    line = Lacking("powerdrive", "15.07")
    found = await read_apart(
        Reader(DriveSession(line, 1, line.profile)), ["15.06", "15.07", "10.40"]
    )
    assert {code: reading.raw for code, reading in found.items()} == {
        "15.06": 1,
        "15.07": None,
        "10.40": 1,
    }
    assert found["15.07"].error == NO_SUCH_WORD


@pytest.mark.parametrize(
    ("family", "silent"), [("powerdrive", ("15.07", "6.42")), ("atv312", ("ttO",))]
)
async def test_absent_drive_is_not_a_drive_without_the_word(
    family: str, silent: tuple[str, ...]
) -> None:
    line = Lacking(family, *silent)
    with pytest.raises(NoAnswer):
        await read_apart(Reader(DriveSession(line, 1, line.profile)), silent[:1])
