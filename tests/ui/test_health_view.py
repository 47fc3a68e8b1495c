"""The last minute on Line: at fixed places, whole at every width, quiet while all is well."""

from __future__ import annotations

import pytest

from tui.bus.model import DeviceCounters, LastMinute, LineCounters
from tui.screens.connection.health_view import health_lines
from tui.widgets.palette import ALARM

WELL = LastMinute(good=612)
POOR = LastMinute(good=489, lost=38, damaged=3, foreign=14, strays=2)
MANY = LastMinute(good=99_999, lost=99_999, damaged=99_999, foreign=99_999, strays=99_999)


def counted(line: LastMinute, drive: LastMinute, device: int = 247) -> LineCounters:
    return LineCounters(minute=line, devices={device: DeviceCounters(minute=drive)})


@pytest.mark.parametrize("width", [60, 79, 80, 100, 119, 120, 200])
def test_figures_never_move_and_are_never_cut(width: int) -> None:
    shown = [
        [line.plain for line in health_lines(counted(minute, minute), 247, width)]
        for minute in (LastMinute(), WELL, POOR, MANY)
    ]
    for lines in shown:
        assert max(map(len, lines)) <= width
        for name in ("lost", "damaged", "foreign", "strays"):
            assert [line.find(name) for line in lines] == [line.find(name) for line in shown[0]]
            assert f" {name}" in lines[0]
        assert "247100" not in "".join(lines)


@pytest.mark.parametrize("width", [60, 80, 120])
def test_row_count_is_the_same_without_a_drive(width: int) -> None:
    found = counted(WELL, WELL)
    assert len(health_lines(found, 247, width)) == len(health_lines(found, None, width))


def test_figures_fit_80_columns() -> None:
    drive = LastMinute(good=81, lost=38, silent=2, damaged=3, strays=2)
    line, own = health_lines(counted(POOR, drive, 2), 2, 80)
    words = "Line 60 s 92 % of 530 good 38 lost 3 damaged 14 foreign 2 strays"
    assert " ".join(line.plain.split()) == words
    # those that it missed before it fell silent, and those since
    words = "Drive 2 65 % of 124 good 40 lost 3 damaged 2 strays"
    assert " ".join(own.plain.split()) == words


def test_only_troubles_are_colored() -> None:
    def alarming(minute: LastMinute) -> list[str]:
        line = health_lines(counted(minute, WELL), None, 80)[0]
        return [line.plain[s.start : s.end].strip() for s in line.spans if s.style == ALARM]

    assert alarming(WELL) == []
    assert alarming(LastMinute(good=612, lost=2, strays=2)) == []
    assert alarming(POOR) == ["92 %", "38", "3", "14"]
    assert alarming(LastMinute(good=600, foreign=3)) == ["3"]
