"""The lines of the Control screen, without a screen."""

from __future__ import annotations

from tui.screens.control.view import LEFT_ROWS, left_lines

LEFT = (
    "Running since 17:34. Started by run, process 4711, which has exited. No program commands it."
)


def test_motor_without_a_commander_is_shown_with_the_keys() -> None:
    lines = [line.plain for line in left_lines(LEFT, 80)]
    text = " ".join(line.strip() for line in lines)
    assert text.startswith(LEFT)
    assert "Press Space to stop it" in text
    assert "T on Monitor to take it over" in text
    assert 1 < len(lines) <= LEFT_ROWS
    assert all(line.startswith("  ") and len(line) <= 80 for line in lines)


def test_motor_with_a_commander_has_no_extra_line() -> None:
    assert left_lines("", 80) == []
