"""Texts of other programs in events of a line: for a person, never control characters."""

from __future__ import annotations

from tui.bus.line_events import DevicesStopped, NoticeReceived
from tui.bus.program import Program

TYPED = "x\x1b[2J\ny"


def test_notice_of_another_program_is_readable() -> None:
    text = NoticeReceived(1, TYPED).text
    assert text.startswith("x")
    assert text.endswith("y")
    assert text.isprintable()


def test_reason_of_a_stop_is_readable() -> None:
    by = DevicesStopped((1,), TYPED, Program("a", "panel", 1)).by
    assert by.startswith("x")
    assert by.endswith("y")
    assert by.isprintable()
