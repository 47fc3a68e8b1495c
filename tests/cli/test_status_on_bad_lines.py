"""`status` on a line that loses replies: known values are shown, others marked."""

from __future__ import annotations

import asyncio
import json
import time
from collections import Counter
from typing import Any

import pytest

from tui.bus.errors import NoAnswer
from tui.bus.line import Line
from tui.cli.shared import drive_status
from tui.session.drive import DriveSession
from tui.session.timeout_report import Timeout, TimeoutWatch

from .commands import ended, tcp_line

TIMEOUT_WORD = 6005
"""Register of TTO of an Altivar 71."""


def lose(
    monkeypatch: pytest.MonkeyPatch, register: int, seconds: float, *, answered: int = 0
) -> None:
    """Let each read of a register end without a reply after this many seconds.

    All but the first `answered` ones of each line.
    """
    read = Line.read
    reads: Counter[int] = Counter()

    async def losing(self: Line, device: int, address: int, count: int = 1, **more: Any) -> Any:
        if address <= register < address + count:
            reads[id(self)] += 1
            if reads[id(self)] <= answered:
                return await read(self, device, address, count, **more)
            await asyncio.sleep(seconds)
            raise NoAnswer(device, 3, address)
        return await read(self, device, address, count, **more)

    monkeypatch.setattr(Line, "read", losing)


@pytest.mark.parametrize(
    ("seconds", "status", "watch"),
    [
        (0.01, 0, "cannot be read: the drive may"),
        (60.0, 3, "not known: TTO was not read"),
    ],
    ids=["no answer", "hangs"],
)
@pytest.mark.sweep
def test_status_shows_known_values_if_a_setting_is_not_read(
    seconds: float, status: int, watch: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drive_status, "STATUS_WITHIN", 2.0)
    with tcp_line("atv71@1") as line:
        lose(monkeypatch, TIMEOUT_WORD, seconds)
        begun = time.monotonic()
        text = ended(status, "status", line).stdout
        document = json.loads(ended(status, "status", line, "--json").stdout)
    assert time.monotonic() - begun < 40
    assert "Altivar 71" in text
    assert ("Not read" in text) is bool(status)
    assert "Output frequency" in text
    assert "0.0 Hz" in text
    assert document["unread"] == ["TTO"] * bool(status)
    assert watch in text
    assert document["state"]["id"] != "unknown"
    assert document["values"]["output_frequency"]["value"] == 0


def test_status_does_not_list_a_shown_timeout_as_unread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The drive reported it at its identification; every later read of it hangs."""
    monkeypatch.setattr(drive_status, "STATUS_WITHIN", 2.0)
    with tcp_line("atv71@1") as line:
        lose(monkeypatch, TIMEOUT_WORD, 60.0, answered=2)
        document = json.loads(ended(0, "status", line, "--json").stdout)
    assert document["timeout"]["seconds"] == document["watch"]["timeout_s"] == 10
    assert document["unread"] == []


def test_status_omits_a_timeout_learned_after_its_words_were_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def learned_late(session: DriveSession, motion: str) -> None:
        session.timeout = Timeout(True, TimeoutWatch(10.0, None))

    monkeypatch.setattr(drive_status, "STATUS_WITHIN", 2.0)
    monkeypatch.setattr(drive_status, "left_behind", learned_late)
    with tcp_line("atv71@1") as line:
        lose(monkeypatch, TIMEOUT_WORD, 60.0)
        document = json.loads(ended(3, "status", line, "--json").stdout)
    assert document["unread"] == ["TTO"]
    assert document["timeout"]["seconds"] is None
    assert document["watch"] is None


def test_status_ends_within_ten_seconds() -> None:
    assert drive_status.STATUS_WITHIN + drive_status.FINDING_WITHIN < 10 - 2
