"""One record per trip out of the journal, however often a panel was opened on the fault."""

from __future__ import annotations

from tui.session.journal import FAULT_WHYS, Entry
from tui.session.report import Trip, trips_of

OLD = "seen from here"


def entry(time: str, answer: str, code: str = "ObF", why: str = "") -> Entry:
    name = {"ObF": "Overbraking", "OLF": "Motor overload"}.get(code, "")
    return Entry(
        time, "sim", 1, "atv71", code, 0, None, "", 0, name, answer, None,
        why or FAULT_WHYS[answer], kind="fault",
    )  # fmt: skip


def test_trips_of_a_fault_seen_again_is_the_same_trip() -> None:
    kept = [entry("1", "tripped"), entry("2", "seen"), entry("3", "seen"), entry("4", "reset")]
    assert trips_of(kept) == [Trip("ObF", "Overbraking", seen="1", tripped="1", reset="4")]


def test_trips_of_a_fault_first_seen_later_has_no_time_of_the_trip() -> None:
    kept = [entry("2", "seen"), entry("3", "seen")]
    assert trips_of(kept) == [Trip("ObF", "Overbraking", seen="2")]


def test_trips_of_a_new_trip_without_a_seen_reset_is_another() -> None:
    kept = [entry("1", "seen"), entry("5", "tripped")]
    assert [trip.seen for trip in trips_of(kept)] == ["1", "5"]
    other = [entry("1", "tripped"), entry("5", "seen", "OLF"), entry("6", "reset", "OLF")]
    assert [(trip.code, trip.reset) for trip in trips_of(other)] == [("ObF", ""), ("OLF", "6")]


def test_trips_of_older_files_counts_each_opened_panel_once() -> None:
    kept = [entry(time, "tripped", why=OLD) for time in "123"]
    kept += [entry("4", "reset", why=OLD), entry("5", "tripped", why=OLD)]
    assert [(trip.tripped, trip.seen, trip.reset) for trip in trips_of(kept)] == [
        ("", "1", "4"),
        ("", "5", ""),
    ]


def test_trips_of_a_code_that_came_later_names_the_trip() -> None:
    kept = [entry("1", "tripped", ""), entry("4", "reset")]
    assert trips_of(kept) == [Trip("ObF", "Overbraking", seen="1", tripped="1", reset="4")]
