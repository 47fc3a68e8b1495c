"""`status` on a line that loses answers: shows what is known, and marks what is not."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any

import pytest

from tui.bus.errors import NoAnswer
from tui.bus.line import Line
from tui.cli.shared import drive_status

from .commands import ended, tcp_line

TIMEOUT_WORD = 6005
"""Register of TTO of an Altivar 71."""


def lose(monkeypatch: pytest.MonkeyPatch, register: int, seconds: float) -> None:
    """Let each read of a register end without an answer after so many seconds."""
    read = Line.read

    async def losing(self: Line, device: int, address: int, count: int = 1, **more: Any) -> Any:
        if address <= register < address + count:
            await asyncio.sleep(seconds)
            raise NoAnswer(device, 3, address)
        return await read(self, device, address, count, **more)

    monkeypatch.setattr(Line, "read", losing)


@pytest.mark.parametrize(
    ("seconds", "status", "watch"),
    [
        (0.01, 0, "not told by this drive"),
        (60.0, 3, "not known: TTO was not read"),
    ],
    ids=["no answer", "hangs"],
)
def test_status_shows_what_is_known_if_a_setting_is_not_read(
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


def test_status_reads_within_ten_seconds() -> None:
    assert drive_status.STATUS_WITHIN + drive_status.FINDING_WITHIN < 10 - 2
