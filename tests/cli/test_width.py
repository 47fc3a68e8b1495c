"""Output on a narrow terminal, and on one without colors."""

from __future__ import annotations

import io
import os
import sys

import pytest
from rich.console import Console

from tui.cli.shared.output import console, readings_table
from tui.cli.shared.rows import say_row, titled
from tui.cli.shared.say import Messages, say
from tui.cli.shared.sets import complain_absent
from tui.drive.profile import library
from tui.drive.values import decode
from tui.session.reading import Reading
from tui.session.shown import Quality

ATV71 = library.load("atv71")
LONG = "10 s. Fault SLF1, the motor coasts; as it leaves the factory."


class Terminal(io.StringIO):
    """A standard output that is a terminal."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Standard output as a terminal of 40 columns; in the test itself, which pytest swaps."""
    found = Terminal()
    monkeypatch.setattr(sys, "stdout", found)
    size = os.terminal_size((40, 24))
    monkeypatch.setattr("tui.cli.shared.say.get_terminal_size", lambda: size)
    return found


def test_lines_break_at_words(monkeypatch: pytest.MonkeyPatch) -> None:
    out = terminal(monkeypatch)
    say_row(titled(16), ("Timeout", LONG))
    lines = out.getvalue().splitlines()
    assert len(lines) > 2
    assert all(len(line) <= 40 for line in lines)
    assert all(line.startswith(" " * 18) for line in lines[1:])
    assert " ".join(" ".join(lines).split()) == f"Timeout {LONG}"


def test_word_longer_than_the_terminal_is_not_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    out = terminal(monkeypatch)
    say("/tmp/" + "x" * 100)
    assert out.getvalue().replace("\n", "") == "/tmp/" + "x" * 100


def test_fitting_text_is_unchanged(monkeypatch: pytest.MonkeyPatch) -> None:
    out = terminal(monkeypatch)
    say("  a   b\n\nc")
    assert out.getvalue() == "  a   b\n\nc\n"


def test_output_to_a_file_is_not_wrapped(capsys: pytest.CaptureFixture[str]) -> None:
    say(LONG * 5)
    assert capsys.readouterr().out == f"{LONG * 5}\n"


def readings(*codes: str) -> dict[str, Reading]:
    found = {}
    for code in codes:
        parameter = ATV71[code]
        value = decode(parameter, 592, {}, None)
        found[code] = Reading(parameter, 592, value, Quality.GOOD, 0.0)
    return found


@pytest.mark.parametrize("width", [40, 50, 60, 80, 120])
@pytest.mark.parametrize("cut", [True, False])
def test_narrow_table_loses_columns_but_no_digit(width: int, cut: bool) -> None:
    out = io.StringIO()
    table = readings_table(readings("RFR", "ETA", "ACC"), width=width, cut=cut)
    Console(file=out, width=width).print(table)
    lines = out.getvalue().splitlines()
    assert all(len(line.rstrip()) <= width for line in lines)
    assert [line.split()[0] for line in lines if line[:1].isalpha()] == [
        "Code", "RFR", "ETA", "ACC",
    ]  # fmt: skip
    assert "592" in out.getvalue()
    assert ("Wire address" in out.getvalue()) == (width >= 60)


def test_no_color_disables_colors(monkeypatch: pytest.MonkeyPatch) -> None:
    out = terminal(monkeypatch)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert console().color_system is not None
    monkeypatch.setenv("NO_COLOR", "1")
    assert console().color_system is None
    console().print(readings_table(readings("RFR")))
    assert "\x1b" not in out.getvalue()


def test_shared_reason_is_reported_once(capsys: pytest.CaptureFixture[str]) -> None:
    why = "Device 2 refused function 3, register {} with exception 2."
    absent = {f"P{n}": why.format(n) for n in range(24)} | {"ACC": "no answer"}
    messages = Messages(as_json=False)
    complain_absent(messages, absent)
    reported = capsys.readouterr().err.splitlines()
    assert len(reported) == 2
    assert reported[0].startswith("drivepanel: 24 could not be read: P0, P1, ")
    assert "ACC could not be read: no answer" in reported[1]
