"""One page for the customer about one drive: identity, settings, tests, trips, signatures."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import NamedTuple

from tui.drive.model import model_read
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.drive.sentences import counted
from tui.drive.settings.compare import compare_settings, factory_side, side_of
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.values import NOT_AVAILABLE

from .connect.named_lines import ReportNames
from .journal import Entry
from .report import ReportParts, trips_of, zoned_time
from .stored_results import StoredResult, results_of, unchanged_since

TESTS_SHOWN = TRIPS_SHOWN = 5
LONGEST_OWN_TEXT = 40
"""Most characters of a text of the drive."""
MOTOR_NAMEPLATE: tuple[Quantity, ...] = (
    "rated_voltage",
    "rated_current",
    "rated_frequency",
    "rated_speed",
)
OPERATION_COUNTERS: tuple[Quantity, ...] = ("energy", "run_hours", "power_on_hours")
SETTINGS_HEAD = ("code", "name", "factory", "now")


class ReportSection(NamedTuple):
    """A part of the page; without a heading its rows are pairs of a name and a value."""

    title: str
    rows: Sequence[Sequence[str]]
    head: Sequence[str] = ()
    note: str = ""


class ReportPage(NamedTuple):
    """The page about one drive, without its form."""

    title: str
    subtitle: str
    sections: Sequence[ReportSection]
    signers: Sequence[str]
    """The two persons who sign; texts may be empty."""


def report_page(
    profile: Profile,
    values: ParameterSet,
    entries: Sequence[Entry],
    results: Sequence[StoredResult],
    names: ReportNames,
) -> ReportPage:
    """Return the page; `entries` are the drive's journal entries, oldest first.

    `results` are those of all drives, newest first.
    """
    parts = ReportParts.from_entries(profile, values, entries)
    sections = [
        _identity(parts),
        _settings(parts),
        _tests(parts, results_of(results, values)),
        _trips(parts),
        *_operation(parts),
    ]
    name = values.head.identity.get("name") or profile.name
    title = f"Drive {values.head.device}: {name}"
    return ReportPage(title, _subtitle(names), sections, _signers(names))


def unread_page(device: int, why: str, names: ReportNames) -> ReportPage:
    """Return the page of a drive that could not be read."""
    section = ReportSection("Not read", [("Reason", why)])
    return ReportPage(f"Drive {device}", _subtitle(names), [section], _signers(names))


def _subtitle(names: ReportNames) -> str:
    return " for ".join(text for text in (names.company, names.customer) if text)


def _signers(names: ReportNames) -> list[str]:
    pairs = (names.company, names.name), (names.customer, names.customer_name)
    return [", ".join(text for text in pair if text) for pair in pairs]


def _identity(parts: ReportParts) -> ReportSection:
    head, profile = parts.values.head, parts.profile
    model = model_read(profile, parts.values.raws)
    motor = [parts.text(p.code) for q in MOTOR_NAMEPLATE if (p := profile.quantity(q)) is not None]
    rows = [
        ("Line", f"{head.line}, address {head.device}"),
        ("Family", profile.name),
        *((key.capitalize(), text[:LONGEST_OWN_TEXT]) for key, text in head.identity.items()),
        *([("Model", model)] if model else []),
        ("Motor settings", ", ".join(t for t in motor if t != NOT_AVAILABLE) or "not known"),
        ("Read", f"{zoned_time(head.time, parts.zone)} {parts.zone_text()}"),
        ("Drive Panel", f"{head.panel}, profile {profile.id} {head.profile_version}"),
    ]
    return ReportSection("Identity", rows)


UNSURE_FACTORY = "? marks factory settings that no document of this family states."


def _settings(parts: ReportParts) -> ReportSection:
    factory = factory_side(parts.profile, parts.values)
    rows = compare_settings(parts.profile, factory, side_of("now", parts.values))
    notes = [
        counted(
            len(factory.raws),
            "The factory setting of 1 parameter is known.",
            "The factory settings of {count} parameters are known.",
        )
    ]
    if absent := len(parts.values.absent):
        single, several = "1 parameter could not be read.", "{count} parameters could not be read."
        notes.append(counted(absent, single, several))
    if any(row.code in factory.unsure for row in rows):
        notes.append(UNSURE_FACTORY)
    cells = [(row.code, row.name, row.a, row.b) for row in rows]
    return ReportSection(
        "Settings that differ from the factory", cells, SETTINGS_HEAD, " ".join(notes)
    )


def _tests(parts: ReportParts, results: Sequence[StoredResult]) -> ReportSection:
    rows = [
        (
            _local(result.begun, parts),
            result.name,
            "PASSED" if result.passed else f"NOT PASSED. {result.why_not or ''}".rstrip(),
            result.steps_text,
            "unchanged" if unchanged_since(result, parts.profile, parts.values) else "CHANGED",
            result.by,
        )
        for result in results
    ]
    head = ("date", "test", "result", "steps", "settings", "by")
    if parts.proofs:
        proof = parts.proofs[-1]
        when = zoned_time(proof.time, parts.zone)[:10]
        rows.append((when, "Communication loss", proof.new, "", "", ""))
    note = "" if rows else "No result of `drivepanel accept` for this drive was found."
    return _limited(ReportSection("Tests", rows, head, note), TESTS_SHOWN)


def _trips(parts: ReportParts) -> ReportSection:
    rows = [
        (
            zoned_time(trip.tripped or trip.seen, parts.zone),
            trip.code,
            trip.name,
            zoned_time(trip.reset, parts.zone),
        )
        for trip in reversed(trips_of(parts.trips))
    ]
    stored = parts.profile.data.faults.parameter
    note = f"Fault or last fault in the drive: {parts.fault_text(stored)}." if stored else ""
    head = ("seen", "fault", "name", "reset")
    return _limited(ReportSection("Trips seen by Drive Panel", rows, head, note), TRIPS_SHOWN)


def _operation(parts: ReportParts) -> list[ReportSection]:
    found = [p for q in OPERATION_COUNTERS if (p := parts.profile.quantity(q)) is not None]
    rows = [(p.name, parts.text(p.code)) for p in found if p.code in parts.values.raws]
    return [ReportSection("Operation", rows)] if rows else []


def _limited(section: ReportSection, most: int) -> ReportSection:
    """Return the section with its first rows; its note counts the others."""
    left = len(section.rows) - most
    if left <= 0:
        return section
    more = counted(left, "1 more is not shown.", "{count} more are not shown.")
    return section._replace(rows=section.rows[:most], note=f"{section.note} {more}".strip())


def _local(time: datetime, parts: ReportParts) -> str:
    return f"{time.astimezone(parts.zone):%Y-%m-%d}"
