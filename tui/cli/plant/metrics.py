"""Lines and drives in the text format of Prometheus, version 0.0.4.

A value is in the base unit that its name contains: seconds for ms and h, ratios for percent. A
value that is not good is omitted, so that a graph has a gap instead of an old number.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, NamedTuple, get_args

from tui.bus.api import TURNAROUND_EDGES, Contact, DeviceCounters, LineStatus
from tui.drive.profile.schema import StateKind
from tui.session.reading import Reading, with_text

from .status import DriveStatus, LineReport

if TYPE_CHECKING:
    from tui.session.drive import DriveSession

METRICS_TYPE = "text/plain; version=0.0.4; charset=utf-8"
PREFIX = "drivepanel"

BASE_UNITS: Mapping[str, tuple[str, str]] = {
    "Hz": ("hertz", "1"),
    "kHz": ("hertz", "1e3"),
    "%": ("ratio", "0.01"),
    "s": ("seconds", "1"),
    "ms": ("seconds", "1e-3"),
    "min": ("seconds", "60"),
    "h": ("seconds", "3600"),
    "V": ("volts", "1"),
    "mV": ("volts", "1e-3"),
    "A": ("amperes", "1"),
    "mA": ("amperes", "1e-3"),
    "µA": ("amperes", "1e-6"),
    "W": ("watts", "1"),
    "kW": ("watts", "1e3"),
    "Wh": ("joules", "3.6e3"),
    "kWh": ("joules", "3.6e6"),
    "MWh": ("joules", "3.6e9"),
    "°C": ("celsius", "1"),
    "rpm": ("rpm", "1"),
    "Nm": ("newton_meters", "1"),
    "ohm": ("ohms", "1"),
    "mH": ("henries", "1e-3"),
    "m": ("meters", "1"),
    "m/s": ("meters_per_second", "1"),
    "bar": ("pascals", "1e5"),
}
"""Suffix of a metric's name and factor of its value, by unit of a profile."""
_NO_NAME = re.compile(r"[^a-z0-9]+")

Labels = Mapping[str, str]


class MetricSample(NamedTuple):
    """One sample of a metric."""

    metric: str
    labels: Labels
    value: float
    suffix: str = ""
    """Suffix of the sample's name: bucket or count of a histogram."""


class MetricHead(NamedTuple):
    """Name, type and help of a metric."""

    kind: str
    help: str


METRICS: Mapping[str, MetricHead] = {
    "build_info": MetricHead("gauge", "The version of Drive Panel."),
    "line_connected": MetricHead("gauge", "1 if the line can be used."),
    "line_requests_total": MetricHead("counter", "Frames that were sent."),
    "line_replies_total": MetricHead("counter", "Whole and correct replies."),
    "line_timeouts_total": MetricHead("counter", "Requests without a reply."),
    "line_damaged_total": MetricHead("counter", "Damaged replies."),
    "line_wrong_total": MetricHead("counter", "Replies to another request or of another device."),
    "line_exceptions_total": MetricHead("counter", "Requests that a drive refused."),
    "line_repeats_total": MetricHead("counter", "Requests that were sent again."),
    "line_late_total": MetricHead("counter", "Whole frames that arrived when no reply was due."),
    "line_sent_bytes_total": MetricHead("counter", "Bytes that were sent."),
    "line_received_bytes_total": MetricHead("counter", "Bytes that were received."),
    "line_busy_seconds_total": MetricHead("counter", "Time in which the line was busy."),
    "line_good_replies_ratio": MetricHead(
        "gauge", "Good replies of the last minute, without those of silent drives."
    ),
    "line_foreign_frames": MetricHead("gauge", "Frames of another master in the last minute."),
    "line_stray_frames": MetricHead("gauge", "Frames that answer no request, in the last minute."),
    "drive_info": MetricHead("gauge", "The profile and the reported identity of the drive."),
    "drive_up": MetricHead("gauge", "1 if the drive was read in the last cycle."),
    "drive_contact": MetricHead("gauge", "1 for the result of the last requests to the drive."),
    "drive_cycle_seconds": MetricHead("gauge", "Measured time from one cycle to the next."),
    "drive_cycle_wished_seconds": MetricHead("gauge", "Cycle time that --every requests."),
    "drive_state": MetricHead("gauge", "1 for the state that the drive is in."),
    "drive_fault_info": MetricHead("gauge", "The fault that the drive is in now."),
    "drive_alarm": MetricHead("gauge", "1 while the drive reports an alarm."),
    "drive_requests_total": MetricHead("counter", "Frames that were sent to the drive."),
    "drive_replies_total": MetricHead("counter", "Whole and correct replies of the drive."),
    "drive_timeouts_total": MetricHead("counter", "Requests that the drive did not answer."),
    "drive_damaged_total": MetricHead("counter", "Damaged replies of the drive."),
    "drive_exceptions_total": MetricHead("counter", "Refusals of the drive, by their code."),
    "drive_good_replies_ratio": MetricHead("gauge", "Good replies of the last minute."),
    "drive_turnaround_seconds": MetricHead(
        "histogram", "From a request's end to its reply's start."
    ),
    "value_good": MetricHead("gauge", "1 if the value was read in the last cycle."),
    "value_age_seconds": MetricHead("gauge", "Time since the value was received."),
    "word": MetricHead("gauge", "The raw value of a word of bits or names."),
    "value": MetricHead("gauge", "A value without a unit."),
}
"""All metrics except those of values with a unit, in the order of output."""


def metrics_text(lines: Sequence[LineReport], version: str, now: float) -> str:
    """Return all metrics of lines and drives as text; `now` is on the monotonic clock."""
    by_metric: dict[str, list[MetricSample]] = {name: [] for name in METRICS}
    for sample in _samples(lines, version, now):
        by_metric.setdefault(sample.metric, []).append(sample)
    parts: list[str] = []
    for metric, samples in by_metric.items():
        if samples:
            unit = metric.removeprefix("value_").replace("_", " ")
            kind, help = METRICS.get(metric) or MetricHead("gauge", f"Values in {unit}.")
            parts += [f"# HELP {PREFIX}_{metric} {help}\n# TYPE {PREFIX}_{metric} {kind}\n"]
            parts += [_written(sample) for sample in samples]
    return "".join(parts)


def value_metric(unit: str) -> tuple[str, Decimal]:
    """Return the name of the metric for values of a unit, and their factor."""
    if not unit:
        return "value", Decimal(1)
    end, factor = BASE_UNITS.get(unit, ("", "1"))
    return f"value_{end or _NO_NAME.sub('_', unit.lower()).strip('_') or 'other'}", Decimal(factor)


def _written(sample: MetricSample) -> str:
    labels = ",".join(f'{name}="{_escaped(text)}"' for name, text in sample.labels.items())
    number = f"{sample.value:.15g}"
    return f"{PREFIX}_{sample.metric}{sample.suffix}{{{labels}}} {number}\n"


def _escaped(text: str) -> str:
    """Return a label's text with escaped characters."""
    return text.replace("\\", r"\\").replace("\n", r"\n").replace('"', r"\"")


def _samples(lines: Iterable[LineReport], version: str, now: float) -> Iterator[MetricSample]:
    yield MetricSample("build_info", {"version": version}, 1)
    for line in lines:
        yield from _line_samples(line)
        for drive in line.drives:
            where = {"line": line.name, "device": str(drive.device)}
            yield from _counter_samples(where, line.counters.devices.get(drive.device))
            yield from _drive_samples(where, drive, now)


def _line_samples(line: LineReport) -> Iterator[MetricSample]:
    where, counted = {"line": line.name}, line.counters
    yield MetricSample("line_connected", where, line.state.status is LineStatus.CONNECTED)
    for name, number in (
        ("requests", counted.requests),
        ("replies", counted.replies),
        ("timeouts", counted.timeouts),
        ("damaged", counted.checksum),
        ("wrong", counted.wrong),
        ("exceptions", counted.exceptions),
        ("repeats", counted.repeats),
        ("late", counted.stale),
        ("sent_bytes", counted.bytes_out),
        ("received_bytes", counted.bytes_in),
        ("busy_seconds", counted.busy_seconds),
    ):
        yield MetricSample(f"line_{name}_total", where, number)
    minute = counted.minute
    if minute.share is not None:
        yield MetricSample("line_good_replies_ratio", where, round(minute.share, 4))
    yield MetricSample("line_foreign_frames", where, minute.foreign)
    yield MetricSample("line_stray_frames", where, minute.strays)


def _counter_samples(where: Labels, counted: DeviceCounters | None) -> Iterator[MetricSample]:
    counted = counted or DeviceCounters()
    for name, number in (
        ("requests", counted.requests),
        ("replies", counted.replies),
        ("timeouts", counted.timeouts),
        ("damaged", counted.checksum),
    ):
        yield MetricSample(f"drive_{name}_total", where, number)
    if (share := counted.minute.whole_share) is not None:
        yield MetricSample("drive_good_replies_ratio", where, round(share, 4))
    for code, number in sorted(counted.exceptions.items()):
        yield MetricSample("drive_exceptions_total", {**where, "exception": f"{code:02X}"}, number)
    total = 0
    for edge, number in zip((*TURNAROUND_EDGES, "+Inf"), counted.turnarounds, strict=True):
        total += number
        yield MetricSample("drive_turnaround_seconds", {**where, "le": str(edge)}, total, "_bucket")
    yield MetricSample("drive_turnaround_seconds", where, total, "_count")


def _drive_samples(where: Labels, drive: DriveStatus, now: float) -> Iterator[MetricSample]:
    yield MetricSample("drive_up", where, drive.cycle is not None and drive.contact == "answers")
    for contact in get_args(Contact):
        yield MetricSample("drive_contact", {**where, "contact": contact}, contact == drive.contact)
    if drive.session is None:
        return
    stated = drive.session.known_identity.reference
    info = {**where, "profile": drive.session.profile.id, "reference": stated}
    yield MetricSample("drive_info", info, 1)
    if drive.cycle is None:
        return
    yield MetricSample("drive_cycle_seconds", where, round(drive.cycle.period, 3))
    yield MetricSample("drive_cycle_wished_seconds", where, drive.cycle.wished)
    state = drive.cycle.state
    if state.headline and not drive.error:
        for kind in get_args(StateKind):
            yield MetricSample("drive_state", {**where, "state": kind}, kind == state.kind)
        yield MetricSample("drive_alarm", where, bool(state.alarm or state.alarms))
        if state.fault is not None:
            fault = {**where, "fault": state.fault.code, "name": state.fault.name}
            yield MetricSample("drive_fault_info", fault, 1)
    for code, reading in with_text(drive.cycle.readings).items():
        yield from _value_samples({**where, **_who(drive.session, code)}, reading, now)


def _who(session: DriveSession, code: str) -> Labels:
    """Return labels with the code of a value, and its quantity if it has one."""
    quantity = session.profile[code].quantity
    return {"code": code, **({"quantity": quantity} if quantity else {})}


def _value_samples(who: Labels, reading: Reading, now: float) -> Iterator[MetricSample]:
    good = reading.quality == "good"
    yield MetricSample("value_good", who, good)
    if reading.raw is None:
        return
    yield MetricSample("value_age_seconds", who, round(reading.age(now), 3))
    if not good:
        return
    if reading.value is None or reading.value.number is None:
        yield MetricSample("word", who, reading.raw)
        return
    if reading.value.unsure:
        return  # no document states the meaning of such a high raw value, so it is not a number
    if reading.value.taught:
        who = {**who, "taught": "true"}
    metric, factor = value_metric(reading.unit)
    yield MetricSample(metric, who, float(reading.value.number * factor))
