"""Lines and drives in the text format of Prometheus, and its server."""

from __future__ import annotations

import asyncio
import re
import socket
from collections.abc import AsyncIterator
from dataclasses import replace
from decimal import Decimal
from typing import get_args

import pytest
import pytest_asyncio

from tui.bus.api import Contact, DeviceCounters, LastMinute, LineCounters
from tui.cli.plant.metrics import BASE_UNITS, METRICS, metrics_text, value_metric
from tui.cli.plant.publishing import LONGEST_REQUEST, MOST_SCRAPES, MetricsServer
from tui.cli.plant.status import DriveStatus, LineReport
from tui.drive.profile import library
from tui.session.reading import with_text

from .plant_sights import NOW, counted, cycle, drive_of, failed, line_of, small_drive

SAMPLE = re.compile(r'drivepanel_[a-z_]+\{([a-z]+="([^"\\]|\\[\\"n])*",?)*\} \S+')
WHERE = 'line="pump",device="2"'


def text_of(*lines: LineReport) -> str:
    return metrics_text(lines, "1.0", NOW)


def samples(*lines: LineReport) -> set[str]:
    return {line for line in text_of(*lines).splitlines() if not line.startswith("#")}


def test_values_are_in_base_units_named_in_the_metric() -> None:
    seen = samples(line_of(drive_of(cycle(small_drive(), ETA=0x27, RFR=499, THD=50))))
    who = f'{WHERE},code="RFR",quantity="output_frequency"'
    assert f"drivepanel_value_hertz{{{who}}} 49.9" in seen
    assert f'drivepanel_value_ratio{{{WHERE},code="THD"}} 0.5' in seen
    assert f'drivepanel_word{{{WHERE},code="ETA"}} 39' in seen
    assert f"drivepanel_value_good{{{who}}} 1" in seen
    assert f"drivepanel_value_age_seconds{{{who}}} 0.5" in seen
    assert f'drivepanel_drive_state{{{WHERE},state="running"}} 1' in seen
    assert f'drivepanel_drive_state{{{WHERE},state="fault"}} 0' in seen
    assert f"drivepanel_drive_up{{{WHERE}}} 1" in seen


@pytest.mark.parametrize("why", ["a failed cycle", "no cycle for long"])
def test_bad_reading_has_no_value(why: str) -> None:
    good = cycle(small_drive(), ETA=0x27, RFR=499)
    if why == "a failed cycle":
        drive = drive_of(failed(good, "No answer."))
    else:
        drive = drive_of(good, now=NOW + 60)
        assert "not polled for 60 s" in drive.error
    seen = text_of(line_of(drive))
    assert "drivepanel_value_hertz" not in seen
    assert "drivepanel_word" not in seen
    assert "drivepanel_drive_state" not in seen
    assert f'drivepanel_value_good{{{WHERE},code="ETA"}} 0' in seen
    assert f"drivepanel_drive_up{{{WHERE}}} 0" in seen
    assert f'drivepanel_value_age_seconds{{{WHERE},code="ETA"}} 0.5' in seen


def test_fault_has_its_code_and_escaped_name() -> None:
    seen = samples(line_of(drive_of(cycle(small_drive(), ETA=0x88, LFT=18))))
    reported = f'drivepanel_drive_fault_info{{{WHERE},fault="ObF",name="Over\\"braking\\\\"}} 1'
    assert reported in seen
    assert f"drivepanel_drive_alarm{{{WHERE}}} 1" in seen
    past = text_of(line_of(drive_of(cycle(small_drive(), ETA=0x27, LFT=18))))
    assert "fault_info" not in past


def test_last_minute_of_line_and_drive_is_a_ratio() -> None:
    drive = drive_of(cycle(small_drive(), ETA=0x27))
    own = DeviceCounters(minute=LastMinute(good=30, lost=8, silent=2))
    line = LastMinute(good=90, lost=8, damaged=2, foreign=5, strays=4)
    seen = samples(line_of(drive, counters=LineCounters(minute=line, devices={2: own})))
    assert 'drivepanel_line_good_replies_ratio{line="pump"} 0.9' in seen
    assert 'drivepanel_line_foreign_frames{line="pump"} 5' in seen
    assert 'drivepanel_line_stray_frames{line="pump"} 4' in seen
    assert f"drivepanel_drive_good_replies_ratio{{{WHERE}}} 0.75" in seen
    assert "good_replies_ratio" not in text_of(line_of(drive))


def test_line_quality_and_turnarounds_add_up() -> None:
    counters = counted([4, 2, 0, 0, 0, 0, 0, 0, 0, 1])
    seen = samples(line_of(drive_of(cycle(small_drive(), ETA=0x27)), counters=counters))
    assert 'drivepanel_line_timeouts_total{line="pump"} 2' in seen
    assert f'drivepanel_drive_exceptions_total{{{WHERE},exception="02"}} 3' in seen
    bucket = "drivepanel_drive_turnaround_seconds_bucket"
    assert f'{bucket}{{{WHERE},le="0.002"}} 4' in seen
    assert f'{bucket}{{{WHERE},le="1.0"}} 6' in seen
    assert f'{bucket}{{{WHERE},le="+Inf"}} 7' in seen
    assert f"drivepanel_drive_turnaround_seconds_count{{{WHERE}}} 7" in seen


def test_uncertain_value_is_nan_and_learned_scale_is_marked() -> None:
    seen = cycle(small_drive(), RFR=499, THD=50)
    changed = {"RFR": {"unsure": True}, "THD": {"taught": True}}
    readings = {
        code: replace(reading, value=replace(reading.value, **changed[code]))  # type: ignore[type-var]
        for code, reading in with_text(seen.readings).items()
    }
    text = text_of(line_of(drive_of(replace(seen, readings=readings))))
    assert "drivepanel_value_hertz" not in text
    assert f'drivepanel_value_ratio{{{WHERE},code="THD",taught="true"}} 0.5' in text


@pytest.mark.parametrize("contact", get_args(Contact))
def test_result_of_the_last_requests_is_one_of_five(contact: Contact) -> None:
    seen = samples(line_of(DriveStatus(2, error="Why.", contact=contact)))
    contacts = [text for text in seen if text.startswith("drivepanel_drive_contact")]
    assert len(contacts) == len(get_args(Contact))
    expected = f'drivepanel_drive_contact{{{WHERE},contact="{contact}"}} 1'
    assert [text for text in contacts if text.endswith(" 1")] == [expected]
    assert f"drivepanel_drive_up{{{WHERE}}} 0" in seen  # no cycle was read


def test_drive_not_polled_recently_is_not_reported_as_silent() -> None:
    good = cycle(small_drive(), ETA=0x27)
    assert drive_of(good, now=NOW + 60).contact == "not_polled"
    assert drive_of(failed(good, "No answer."), now=NOW + 60).contact == "silent"


def test_cycle_time_is_published_with_the_configured_one() -> None:
    slow = replace(cycle(small_drive(), ETA=0x27), period=5.8, wished=1.0)
    seen = samples(line_of(drive_of(slow)))
    assert f"drivepanel_drive_cycle_seconds{{{WHERE}}} 5.8" in seen
    assert f"drivepanel_drive_cycle_wished_seconds{{{WHERE}}} 1" in seen


def test_drive_never_found_is_down_without_values() -> None:
    seen = samples(line_of(DriveStatus(2, error="Nobody answers.")))
    assert f"drivepanel_drive_up{{{WHERE}}} 0" in seen
    assert not [text for text in seen if "value" in text or "info{line" in text]


def test_every_line_is_valid_and_every_metric_has_one_type() -> None:
    drive = drive_of(cycle(small_drive(), ETA=0x88, RFR=1, THD=2, LFT=18))
    text = text_of(line_of(drive, counters=counted([1] * 10)), line_of(drive, name='a"b\\c\nd'))
    assert text.endswith("\n")
    types = []
    for line in text.splitlines():
        if line.startswith("# TYPE "):
            types.append(line.split()[2])
        elif not line.startswith("# HELP "):
            assert SAMPLE.fullmatch(line), line
            assert line.startswith(types[-1]), "samples of one metric stand together"
    assert len(types) == len(set(types))


def test_every_metric_has_a_type_and_a_description() -> None:
    for name, head in METRICS.items():
        assert head.kind in ("gauge", "counter", "histogram"), name
        assert (head.kind == "counter") is name.endswith("_total"), name
        assert re.fullmatch(r"[A-Z1].* .*\.", head.help), name


def test_every_unit_of_every_profile_has_a_metric_name() -> None:
    units = {p.unit for listing in library.listings() for p in library.load(listing.id).parameters}
    for unit in units:
        name, factor = value_metric(unit)
        assert re.fullmatch(r"[a-z][a-z_0-9]*", name)
        assert unit in BASE_UNITS or unit == "", f"{unit}: {name}, {factor}"
    assert value_metric("l/min") == ("value_l_min", Decimal(1))
    assert value_metric("µ") == ("value_other", Decimal(1))
    assert value_metric("kHz") == ("value_hertz", Decimal(1000))


# The server


@pytest_asyncio.fixture
async def served() -> AsyncIterator[int]:
    """Port of a server with one metric."""
    server = MetricsServer(lambda: "drivepanel_x 1\n")
    _, port = await server.listen("127.0.0.1", 0)
    yield port
    await server.close()


async def requested(port: int, request: bytes) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    try:
        return await reader.read()
    except ConnectionResetError:
        # it was disconnected with unread bytes of its request
        return b""
    finally:
        writer.close()


async def test_server_answers_metrics_requests_only(served: int) -> None:
    answer = await requested(served, b"GET /metrics HTTP/1.1\r\nHost: LOCALHOST:1\r\n\r\n")
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200 OK\r\nContent-Type: text/plain; version=0.0.4;")
    assert body == b"drivepanel_x 1\n"
    assert (await requested(served, b"GET /metrics?a=1 HTTP/1.0\r\n\r\n")).startswith(
        b"HTTP/1.1 200"
    )
    head_only = await requested(served, b"HEAD /metrics HTTP/1.1\r\n\r\n")
    assert head_only.endswith(b"Content-Length: 15\r\nConnection: close\r\n\r\n")
    assert (await requested(served, b"GET / HTTP/1.1\r\n\r\n")).startswith(b"HTTP/1.1 404")
    assert (await requested(served, b"POST /metrics HTTP/1.1\r\n\r\n")).startswith(b"HTTP/1.1 405")
    assert (await requested(served, b"\x16\x03\r\n\r\n")).startswith(b"HTTP/1.1 405")


@pytest.mark.internal_errors
async def test_unforeseen_error_does_not_end_the_service() -> None:
    wrong = ["once"]

    def reported() -> str:
        if wrong:
            raise RuntimeError(wrong.pop())
        return 'x{name="\udcff"} 1\n'

    server = MetricsServer(reported)
    _, port = await server.listen("127.0.0.1", 0)
    assert (await requested(port, b"GET /metrics HTTP/1.1\r\n\r\n")).startswith(b"HTTP/1.1 500")
    assert (await requested(port, b"GET /metrics HTTP/1.1\r\n\r\n")).endswith(b'x{name="?"} 1\n')
    await server.close()


async def test_client_with_too_long_a_request_is_disconnected(served: int) -> None:
    assert await requested(served, b"GET /" + b"x" * 2 * LONGEST_REQUEST) == b""
    assert (await requested(served, b"GET /metrics HTTP/1.1\r\n\r\n")).startswith(b"HTTP/1.1 200")


async def test_idle_connections_do_not_block_others(served: int) -> None:
    idle = [await asyncio.open_connection("127.0.0.1", served) for _ in range(MOST_SCRAPES)]
    assert (await requested(served, b"GET /metrics HTTP/1.1\r\n\r\n")).startswith(b"HTTP/1.1 200")
    assert await idle[0][0].read() == b"", "the oldest one has made room"
    for _, writer in idle:
        writer.close()


@pytest.mark.parametrize(
    ("host", "status"),
    [
        (b"127.0.0.1", 200),
        (b"127.0.0.1:9101", 200),
        (socket.gethostname().encode(), 200),
        (b"evil.example", 421),
        (b"127.0.0.1.evil.example:9101", 421),
        (b"10.0.0.1", 421),
        (b"[::1]:9101", 421),
        (b"", 421),
        (b"127.0.0.1\r\nHost: evil.example", 421),
    ],
)
async def test_request_with_another_host_name_is_refused(
    served: int, host: bytes, status: int
) -> None:
    """A web page in a browser of this network could read them under another host name."""
    answer = await requested(served, b"GET /metrics HTTP/1.1\r\nhost: " + host + b"\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 %d " % status)
