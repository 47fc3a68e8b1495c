"""Troubles of a line by its last minute: thresholds, hysteresis, and messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest

from tui.bus.model import DeviceCounters, LastMinute, LineCounters
from tui.session.monitor.line_health import LineHealth, percent


def counted(line: LastMinute, drives: Mapping[int, LastMinute] | None = None) -> LineCounters:
    each = {device: DeviceCounters(minute=minute) for device, minute in (drives or {}).items()}
    return LineCounters(minute=line, devices=each)


def kinds_after(*minutes: LastMinute) -> list[Sequence[str]]:
    """Kinds of trouble after each of these checks of a line with one drive."""
    health, found = LineHealth(), list[Sequence[str]]()
    for minute in minutes:
        health.look(counted(minute, {1: minute}))
        found.append([trouble.kind for trouble in health.troubles])
    return found


@pytest.mark.parametrize(
    ("minute", "kinds"),
    [
        (LastMinute(good=600), []),
        (LastMinute(good=590, lost=10), []),
        (LastMinute(good=580, lost=12, damaged=8), ["poor"]),
        (LastMinute(good=17, lost=2), []),
        (LastMinute(good=17, lost=3), ["poor"]),
        (LastMinute(), []),
        (LastMinute(good=600, foreign=2, strays=2), []),
        (LastMinute(good=600, foreign=3), ["foreign"]),
        (LastMinute(good=600, strays=3), ["strays"]),
        (LastMinute(good=60, lost=60, foreign=9, strays=9), ["poor", "foreign", "strays"]),
    ],
)
def test_line_health_depends_on_the_last_minute(minute: LastMinute, kinds: list[str]) -> None:
    assert kinds_after(minute) == [kinds]


def test_trouble_has_hysteresis() -> None:
    poor, little, well = (LastMinute(good=g, lost=1000 - g) for g in (979, 985, 990))
    assert kinds_after(little, poor, little, well, little) == [[], ["poor"], ["poor"], [], []]
    few = LastMinute(good=10, lost=1)
    assert kinds_after(few, poor, few, LastMinute()) == [[], ["poor"], ["poor"], []]
    minute, none = LastMinute(good=99, foreign=1, strays=1), LastMinute(good=99)
    both = LastMinute(good=99, foreign=3, strays=3)
    strange = ["foreign", "strays"]
    assert kinds_after(minute, both, minute, none, minute) == [[], strange, strange, [], []]


def test_begin_and_end_of_trouble_are_reported_once() -> None:
    health = LineHealth()
    drives = {2: LastMinute(good=81, lost=38, damaged=3), 5: LastMinute(good=408)}
    poor = LastMinute(good=489, lost=38, damaged=3)
    assert health.look(counted(poor, drives)) == [
        (
            "alarm",
            "Only 92 % of 530 replies were good in the last minute: 38 lost, 3 damaged. Worst:"
            " drive 2, 66 %. Choose drive 2 on Line and press N for the cause.",
        )
    ]
    assert health.look(counted(poor, drives)) == []
    ((kind, text),) = health.look(counted(LastMinute(good=489, lost=38, foreign=7), drives))
    assert (kind, text.split(".")[0]) == ("alarm", "7 foreign frames in the last minute")
    assert health.look(counted(LastMinute(good=600))) == [
        (
            "done",
            "The line is healthy again: 100 % of the replies were good in the last minute.",
        )
    ]
    assert health.look(counted(LastMinute(good=600))) == []


def test_single_poor_drive_is_named() -> None:
    health = LineHealth()
    drives = {device: LastMinute(good=300) for device in range(1, 11)}
    drives[4] = LastMinute(good=50, lost=20)
    line = LastMinute(good=2750, lost=20)
    ((_, text),) = health.look(counted(line, drives))
    assert text.startswith("Only 71 % of 70 replies of drive 4 were good in the last minute: 20")
    assert health.troubles[0].signs[0] == "drive 4 71 % good"


def test_dead_drive_raises_no_line_alert() -> None:
    health = LineHealth()
    drives = {1: LastMinute(good=300), 2: LastMinute(good=100, silent=40), 9: LastMinute(silent=30)}
    assert health.look(counted(LastMinute(good=400), drives)) == []


def test_drive_that_never_answered_is_not_the_worst() -> None:
    health = LineHealth()
    drives = {1: LastMinute(good=90, lost=10), 2: LastMinute(good=99, lost=1), 3: LastMinute()}
    ((_, text),) = health.look(counted(LastMinute(good=189, lost=11), drives))
    assert "Worst: drive 1, 90 %." in text


def test_drive_with_most_lost_replies_is_the_worst() -> None:
    drives = {1: LastMinute(good=21), 2: LastMinute(good=14, lost=4), 3: LastMinute(good=1, lost=1)}
    ((_, text),) = LineHealth().look(counted(LastMinute(good=36, lost=5), drives))
    assert "Worst: drive 2, 77 %." in text


def test_share_is_rounded_down() -> None:
    shares = (None, 0.0, 0.9799, 0.999, 1.0)
    assert [percent(share) for share in shares] == [" --", "  0", " 97", " 99", "100"]
