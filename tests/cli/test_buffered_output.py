"""Lines for a reader that may be slow, or gone."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from tui.cli.running import buffered_output
from tui.cli.running.buffered_output import LINES_WAITING, BufferedOutput


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, int]]:
    """Both ends of a pipe in the place of standard output."""
    reads, writes = os.pipe()
    out = SimpleNamespace(fileno=lambda: writes, encoding="ascii")
    monkeypatch.setattr(buffered_output, "sys", SimpleNamespace(stdout=out))
    yield reads, writes
    os.close(writes)


def test_each_line_is_put_out_in_its_order(ends: tuple[int, int]) -> None:
    output = BufferedOutput(lambda: None)
    for text in ("first", "30 °C", ""):
        output.say(text)
    output.finish()
    assert os.read(ends[0], 100) == b"first\n30 ?C\n\n"
    os.close(ends[0])


def test_slow_reader_misses_the_oldest_lines_and_holds_up_nothing(ends: tuple[int, int]) -> None:
    os.set_blocking(ends[0], False)
    output = BufferedOutput(lambda: None)
    wide = "x" * 65_000
    for number in range(3 * LINES_WAITING):
        output.say(f"{number} {wide}")
    os.set_blocking(ends[0], True)
    reader = os.fdopen(ends[0], "rb")
    last = f"{3 * LINES_WAITING - 1} "
    numbers = []
    for line in reader:
        numbers.append(int(line.split()[0]))
        if line.startswith(last.encode()):
            break
    assert numbers == sorted(numbers)
    assert LINES_WAITING <= len(numbers) <= LINES_WAITING + 3
    output.finish()
    reader.close()


def test_reader_that_is_gone_is_reported_once_and_later_lines_are_dropped(
    ends: tuple[int, int],
) -> None:
    os.close(ends[0])
    reports: list[str] = []
    reported = threading.Event()

    def gone() -> None:
        reports.append("gone")
        reported.set()

    output = BufferedOutput(gone)
    output.say("first")
    assert reported.wait(20)
    output.say("second")
    output.finish()
    assert reports == ["gone"]
