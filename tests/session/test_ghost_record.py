"""Ghosts from the files of a record: rows become exchanges again."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.session.record.ghost import GhostError, GhostRecord, read_recorded
from tui.session.record.record_file import RecordFile
from tui.session.record.schema import EventRow, ReplyRow

BEGUN = 1_700_000_000_000_000
PROFILE = '{"profile": "atv71", "hash": "other"}'


def row(at: int, function: int, **more: object) -> ReplyRow:
    """A row `at` microseconds after the first."""
    empty = ReplyRow(BEGUN + at, 5_000 + at, 20_000, 2, function, None, 0, 0, None, None, None,
                     0, "")  # fmt: skip
    return empty._replace(**more)  # type: ignore[arg-type]


ROWS = (
    (row(0, 3, address=3201, registers=2, words=b"\0\1\0\2"), "030c810002", "030400010002"),
    (row(1_000_000, 6, address=9001, registers=1, words=b"\0\x32"), "0623290032", "0623290032"),
    (
        row(2_000_000, 16, address=9001, registers=2, words=b"\0\1\0\2"),
        "10232900020400010002",
        "1023290002",
    ),
    (
        row(3_000_000, 3, address=1, registers=1, quality=1, received=b"\x83\2"),
        "0300010001",
        "8302",
    ),
    (row(4_000_000, 3, address=3201, registers=1, quality=2), "030c810001", None),
    (row(5_000_000, 43, sent=b"\x2b\x0e\1\0", received=b"\x2b\x0e\1"), "2b0e0100", "2b0e01"),
    (row(6_000_000, 3, address=7, registers=1, quality=1), "0300070001", "8302"),
)


def file(tmp_path: Path, *rows: ReplyRow) -> str:
    path = tmp_path / "record.sqlite"
    made = RecordFile(path, "serial:/dev/x", "test")
    made.write(rows, [EventRow(BEGUN, 5_000, 2, "profile", PROFILE)])
    made.close()
    return f"{path}@2"


def record_of_one_reply(tmp_path: Path) -> str:
    """Path of a record that has one reply of an Altivar 71 at address 2."""
    return file(tmp_path, ROWS[0][0]).removesuffix("@2")


def test_rows_become_the_requests_and_replies_of_the_wire(tmp_path: Path) -> None:
    found: GhostRecord = read_recorded(file(tmp_path, *(item for item, _, _ in ROWS)))
    assert found.profile is not None
    assert (found.device, found.profile.id, found.begun) == (2, "atv71", BEGUN / 1e6)
    assert [
        (item.at, item.took, item.request.hex(), item.reply and item.reply.hex())
        for item in found.exchanges
    ] == [(number, 0.02, request, reply) for number, (_, request, reply) in enumerate(ROWS)]


def test_unawaited_and_doubtful_replies_are_not_played(tmp_path: Path) -> None:
    doubtful = [row(at, 3, address=1, registers=1, words=b"\0\1", quality=at) for at in (5, 6, 7)]
    found = read_recorded(file(tmp_path, ROWS[0][0], *doubtful))
    assert len(found.exchanges) == 1


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("record.sqlite", "write FILE@ADDRESS"),
        ("record.sqlite@300", "write FILE@ADDRESS"),
        ("nothing.sqlite@2", "is not a file"),
    ],
)
def test_place_that_is_no_record_is_refused(text: str, why: str) -> None:
    with pytest.raises(GhostError, match=why):
        read_recorded(text)


def test_drive_without_replies_is_refused_with_the_drives_of_the_file(tmp_path: Path) -> None:
    text = file(tmp_path, ROWS[0][0]).replace("@2", "@5")
    with pytest.raises(GhostError, match=r"no whole replies of drive 5. Its drives: 2\."):
        read_recorded(text)


def test_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "x.sqlite"
    other.write_text("not a record")
    with pytest.raises(GhostError, match="cannot be read"):
        read_recorded(f"{other}@2")
