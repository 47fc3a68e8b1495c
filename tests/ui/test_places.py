"""Nothing on the Monitor screen moves when values change, whatever the drive and its values."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.text import Text

from tests.sweeps import kept
from tui.bus.line import Frame
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.values import type_range
from tui.screens.frames.frame_view import frame_line
from tui.screens.keys.action import CONNECTION, MONITOR
from tui.screens.keys.table import EVERYWHERE, keys_line, screen_actions
from tui.screens.monitor.arrange import OUTSIDE, WIDE, Arrangement, arrange
from tui.screens.monitor.assembly import (
    codes_beside,
    line_figures,
    monitor_parts,
    motor_lines,
    other_values,
    value_cells,
    watched_words,
)
from tui.screens.monitor.readouts import gauge, readout_lines
from tui.screens.monitor.screen import order_keys
from tui.screens.monitor.view import View
from tui.session.monitor.trend import TrendPoint, readout_parameter
from tui.session.shown import Quality
from tui.widgets.drawing import key_line
from tui.widgets.palette import STOP_KEY

from . import fakes

ATV71 = library.load("atv71")
PROFILES = [listing.id for listing in library.listings()]


def view_of(profile: Profile, raws: dict[str, int], age: float = 0.1) -> View:
    snapshot = fakes.snapshot_of(profile, raws, age=age)
    line = fakes.StillLine()
    return View(
        profile=profile,
        snapshot=snapshot,
        line=line.state,
        device=2,
        counters=line.counters,
        trend=tuple(TrendPoint(fakes.NOW - i, (i * 1.0, None, 50.0)) for i in range(60, 0, -1)),
        period=0.5,
        now=fakes.NOW,
    )


@st.composite
def any_raws(draw: st.DrawFn, profile: Profile) -> dict[str, int]:
    """Raw values for all that Monitor shows, each anywhere in its type."""
    codes = {value.parameter for value in profile.data.monitoring.values}
    codes |= {value.high for value in profile.data.monitoring.values if profile.get(value.high)}
    codes |= set(profile.data.faults.history)
    for code in list(codes):
        scale = profile[code].scale_by
        codes |= {scale.parameter} if scale else set()
    return {
        code: draw(st.integers(*type_range(profile[code])))
        for code in sorted(codes)
        if draw(st.integers(0, 9))
    }


def test_replay_has_the_rate_of_its_record_and_no_alarm() -> None:
    """The panel requests 2 cycles a second of a drive, whatever the record has."""
    live = view_of(ATV71, fakes.RUNNING)
    assert live.snapshot is not None
    live = replace(live, snapshot=replace(live.snapshot, rate=1.0))
    shown = [line_figures(view) for view in (live, replace(live, replayed=True))]
    assert [text.plain.split(" by ")[0].strip() for text in shown] == [
        "1.0 of 2.0 cycles/s", "1.0 cycles/s",
    ]  # fmt: skip
    assert [bool(text.spans) for text in shown] == [True, False]


SIZES = st.sampled_from([(60, 16), (60, 20), (80, 24), (100, 30), (120, 40), (200, 60)])


def room_of(profile: Profile, size: tuple[int, int]) -> Arrangement:
    return arrange(*size, len(other_values(profile, wide=size[0] >= WIDE)))


@pytest.mark.parametrize("profile_id", kept(PROFILES, "atv21", "atv71", "powerdrive"))
@settings(max_examples=40)
@given(data=st.data())
def test_every_part_keeps_its_size_and_its_width(profile_id: str, data: st.DataObject) -> None:
    profile = library.load(profile_id)
    room = room_of(profile, data.draw(SIZES))
    word = data.draw(st.none() | st.integers(0, 9))
    views = [
        replace(view_of(profile, data.draw(any_raws(profile)), age=age), word=word)
        for age in (0.1, 20.0)
    ]
    first, second = (monitor_parts(view, room, watched_words(profile)) for view in views)
    for part, lines in first.items():
        assert len(lines) == len(second[part]), part
        for line in (*lines, *second[part]):
            assert line.cell_len <= room.width, (part, line.plain)


@given(width=st.integers(60, 220), height=st.integers(16, 80), count=st.integers(0, 20))
def test_parts_fill_the_terminal_exactly(width: int, height: int, count: int) -> None:
    room = arrange(width, height, count)
    assert room.top + room.values + room.curve + room.bottom == height - OUTSIDE
    assert room.top >= 5
    assert room.bottom >= 1
    band = room.band + 1 if room.band else 0
    assert 1 + room.plot + band + room.axis == room.curve
    assert room.plot >= 3


def test_slow_link_gets_one_curve_and_two_readouts() -> None:
    room = arrange(120, 40, 9, lean=True)
    assert room.band == 0
    assert room.plot >= 16
    parts = monitor_parts(view_of(ATV71, fakes.RUNNING), room, [])
    assert "Torque" not in parts["readouts"][room.lead].plain
    assert "Torque" in " ".join(line.plain for line in parts["motor"])


@pytest.mark.parametrize("family", PROFILES)
@pytest.mark.parametrize(
    ("size", "plot", "band"),
    [((60, 16), 3, 0), ((80, 24), 9, 0), ((120, 40), 16, 5), ((200, 60), 30, 9)],
)
def test_curve_has_rows_enough(family: str, size: tuple[int, int], plot: int, band: int) -> None:
    room = room_of(library.load(family), size)
    assert room.plot >= plot
    assert room.band >= band


@pytest.mark.parametrize("size", [(60, 16), (60, 20), (80, 24), (120, 40), (200, 60)])
@pytest.mark.parametrize("profile_id", PROFILES)
def test_parts_have_their_given_rows(profile_id: str, size: tuple[int, int]) -> None:
    profile = library.load(profile_id)
    room = room_of(profile, size)
    parts = monitor_parts(view_of(profile, {}), room, watched_words(profile))
    assert len(parts["readouts"]) == room.top
    assert len(parts["state"]) == room.top
    assert len(parts["motor"]) == room.values
    assert len(parts["curve"]) == room.curve
    assert len(parts["message"]) == room.bottom


@pytest.mark.parametrize("profile_id", kept(PROFILES, "atv21", "atv71", "powerdrive"))
@settings(max_examples=40)
@given(data=st.data())
def test_numbers_and_units_are_aligned(profile_id: str, data: st.DataObject) -> None:
    """Each column has right-aligned numbers, followed by the units."""
    profile = library.load(profile_id)
    room = room_of(profile, (80, 24))
    for _ in range(2):
        view = view_of(profile, data.draw(any_raws(profile)))
        lines = motor_lines(view, 80, room.values, room.columns)
        cells = 79 // room.columns
        for line in lines:
            for column in range(room.columns):
                part = line.plain[1 + column * cells : 1 + (column + 1) * cells]
                end = value_cells(cells, any(v.high for v in other_values(profile))) - 4
                assert not part.strip() or (part[end - 1] != " " and part[end] == " "), part


def test_values_shown_beside_monitor_are_read() -> None:
    """The command and reference sources would be dashes."""
    for profile in map(library.load, PROFILES):
        channels = [profile.quantity("command_channel"), profile.quantity("reference_channel")]
        wanted = {channel.code for channel in channels if channel is not None}
        wanted |= {word.code for word in watched_words(profile)}
        wanted |= {
            value.high for value in profile.data.monitoring.values if profile.get(value.high)
        }
        assert wanted == set(codes_beside(profile))


def test_large_digits_are_aligned_whatever_their_value() -> None:
    profile = library.load("atv71")
    found = set()
    for raw in (0, 5, 500, 5999, -500):
        rows = [
            row.plain for row in readout_lines(view_of(profile, {**fakes.RUNNING, "RFR": raw}), 50)
        ]
        found.add((rows[0].index(" Hz"), rows[3].index("."), rows[4].index(" 60 ┘")))
        assert {len(row) for row in rows} == {50}
    assert len(found) == 1


@given(
    st.none() | st.floats(-1e4, 1e4),
    st.floats(-200, 0),
    st.floats(1, 200),
    st.integers(4, 60),
    st.none() | st.floats(-1e4, 1e4),
)
def test_bar_has_its_width_whatever_its_value(
    value: float | None, low: float, high: float, width: int, mark: float | None
) -> None:
    drawn = gauge(value, low, high, width, mark)
    assert drawn.cell_len == width
    assert drawn.plain.count("┃") == (mark is not None)


def test_bar_is_filled_from_zero_to_either_side() -> None:
    forward, reverse = gauge(30, 0, 60, 22).plain, gauge(-30, -60, 60, 22).plain
    assert forward == "├━━━━━━━━━━──────────┤"
    assert reverse == "├─────━━━━━┼─────────┤"


def keys_shown(screen: str, width: int, stops: str = "STOP") -> Text:
    """The key line of a screen, as it draws it; `stops` names the target of the stop key."""
    keys = keys_line(screen, width, stops)
    profile = library.load("atv71")
    return (
        order_keys(view_of(profile, fakes.RUNNING), keys) if screen == MONITOR else key_line(keys)
    )


@pytest.mark.parametrize("screen", EVERYWHERE)
@given(width=st.integers(30, 200))
def test_stop_key_comes_first_in_red_and_is_never_cut(screen: str, width: int) -> None:
    line = keys_shown(screen, width)
    assert line.cell_len <= width
    assert line.plain.startswith(" Space STOP  ")
    assert "? help" in line.plain
    red = [line.plain[s.start : s.end] for s in line.spans if s.style == STOP_KEY]
    assert red == ["Space", " STOP"]


@pytest.mark.parametrize("screen", EVERYWHERE)
def test_no_key_is_dropped_at_80_columns(screen: str) -> None:
    target = "ALL" if screen == CONNECTION else "99"
    line = keys_shown(screen, 80, f"STOP {target}").plain
    assert line.startswith(f" Space STOP {target}  ")
    labels = [action for action in screen_actions(screen) if action.label][1:]
    wanted = [f" {action.shown} {action.label}" for action in labels]
    assert [words for words in wanted if words not in line] == []


@given(
    data=st.binary(max_size=300),
    note=st.sampled_from(["", "exception 2", "checksum wrong"]),
    width=st.integers(60, 200),
)
def test_frame_fits_its_row_and_keeps_its_note(data: bytes, note: str, width: int) -> None:
    line = frame_line(Frame(0.0, "in", data, note), 3.0, 0.012, width)
    assert line.cell_len <= width
    assert line.plain.endswith(note)
    assert ("…" in line.plain) == (data.hex(" ").upper() not in line.plain)


def test_value_older_than_three_cycles_is_dimmed_with_its_age() -> None:
    profile = library.load("atv71")
    view = view_of(profile, fakes.RUNNING, age=7.0)
    reading = view.reading("RFR")
    assert reading is not None
    assert reading.quality is Quality.STALE
    heading, *_ = readout_lines(view, 50)
    assert heading.plain.startswith("┌ Output Hz ")
    assert " 7s old ┐" in heading.plain
    row = motor_lines(view, 80, 3, 3)[0]
    assert "7s" in row.plain
    assert "rpm" not in row.plain


@pytest.mark.parametrize("family", [listing.id for listing in library.listings()])
def test_no_value_is_shown_twice(family: str) -> None:
    profile = library.load(family)
    readouts = [readout_parameter(profile, name) for name in ("output_frequency", "motor_current")]
    codes = {parameter.code for parameter in readouts if parameter is not None}
    assert codes
    assert not codes & {value.parameter for value in other_values(profile)}
