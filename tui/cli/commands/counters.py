"""`drivepanel counters`: what was exchanged with a drive, as counted here and by the drive."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from ..shared.diagnosis_documents import counters_document
from ..shared.drive_commands import arm_option, close_journal, journal_document, need_arming
from ..shared.errors import (
    DIFFERENT,
    DONE,
    DRIVE_REFUSED,
    LINE_TROUBLE,
    REFUSED_HERE,
    Failure,
    end_with,
)
from ..shared.numbers import seconds as seconds_range
from ..shared.options import (
    Target,
    connect_drive,
    drive_options,
    force_profile_option,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.output import drive_fields, print_json
from ..shared.registration import WRITING, command
from ..shared.rows import say_row, titled
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.counters.watch import CountersNow, CounterWatch


FRAMES_SENT = 20
"""Frames sent for counting (default)."""
MOST_FRAMES = 10_000
COUNTER_LOOKS = 3
COUNTER_TITLES = titled(16)


@command(
    "Compare frame counts with the drive's own counters.",
    group="Troubleshoot",
    statuses=(DIFFERENT, *WRITING),
)
@line_argument
@drive_options
@force_profile_option
@click.option(
    "--frames",
    type=click.IntRange(0, MOST_FRAMES),
    default=FRAMES_SENT,
    show_default=True,
    help="Send this many frames to count; they change nothing.",
)
@click.option(
    "--for",
    "seconds",
    type=seconds_range(),
    default=0.0,
    metavar="SECONDS",
    help="Count frames of other programs for S seconds.",
)
@click.option("--reset-drive", is_flag=True, help="Set the drive's own counters to 0 before.")
@arm_option
@read_only_option
@json_option
def counters(
    target: Target,
    frames: int,
    seconds: float,
    reset_drive: bool,
    arm: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Count the frames to a drive, and compare them with the drive's own counters.

    Ends with 1 if frames were lost or damaged, or if another master polls the drive.
    """
    from tui.session.counters.watch import CounterWatch

    if reset_drive:
        need_arming(arm, "--reset-drive sets the drive's own counters to 0")

    async def work(opened: OpenLine) -> int:
        session = await connect_drive(opened, target)
        watch = CounterWatch(session)
        if reset_drive:
            await _reset(watch)
        await _look(watch)
        answered = await watch.echo(frames)
        await asyncio.sleep(seconds)
        await _look(watch)
        found = watch.now()
        if as_json:
            fields = drive_fields(target.line_text, session)
            print_json(counters_document(fields, found, frames, answered, reset=reset_drive))
        else:
            for title, text in _rows(found):
                say_row(COUNTER_TITLES, (title, text))
            for difference in found.differences:
                say(difference.text)
            if found.agree:
                say(found.agreeing)
        if watch.trouble:
            return DRIVE_REFUSED if watch.is_refused else LINE_TROUBLE
        return DONE if found.agree else DIFFERENT

    end_with(on_line(target, work, read_only=read_only))


async def _look(watch: CounterWatch) -> None:
    """Read the counters, again after a lost reply: they matter most on such a line."""
    for _ in range(COUNTER_LOOKS):
        await watch.look()
        if not watch.trouble:
            return


async def _reset(watch: CounterWatch) -> None:
    if not watch.can_reset_drive:
        text = _READ_ONLY if watch.session.line.read_only else _NO_RESET
        raise Failure(text.format(device=watch.session.device), REFUSED_HERE)
    journal = journal_document()
    try:
        await watch.reset_drive(journal)
    finally:
        await asyncio.to_thread(close_journal, journal)


_READ_ONLY = "The counters of device {device} are not reset: the line is read-only."
_NO_RESET = "The counters of device {device} are not reset: it has no such command."
_BY_OWNER = "{owner}, which owns the line; for {seconds:.1f} s"
_BY_THIS = "this program; for {seconds:.1f} s"
_EXACTLY = (
    "{last.frames} frames, {last.damaged} with a wrong checksum;"
    " {since.frames} and {since.damaged} since the first look"
)
_AT_LEAST = (
    "{last.frames} frames, {last.damaged} or more with a wrong checksum;"
    " {since.frames} and {since.damaged} since the first look"
)


def _rows(found: CountersNow) -> Iterator[tuple[str, str]]:
    """Yield the counts as titles with their texts."""
    from tui.session.counters.compare import bars

    ours = found.since
    by = _BY_OWNER if found.counted_by else _BY_THIS
    yield "Counted by", by.format(owner=found.counted_by, seconds=found.seconds)
    yield "Sent", f"{ours.requests} frames, {ours.bytes_out} bytes, {ours.repeats} of them repeats"
    yield "Answered", f"{ours.replies}, {ours.bytes_in} bytes"
    lost = f"{ours.timeouts} timeouts, {ours.checksum} damaged, {ours.wrong} unexpected"
    yield "Not answered", lost
    yield "Last minute", _minute_text(found)
    yield "Refused", ", ".join(f"exception {c}: {n}" for c, n in ours.exceptions.items()) or "0"
    if found.line_load is not None and found.device_load is not None:
        yield "Load of the line", f"{found.line_load:.0%}, {found.device_load:.0%} with this drive"
    seen = [f"{bar.label}: {bar.count}" for bar in bars(ours.turnarounds) if bar.count]
    yield "Turnaround", ", ".join(seen) or "-----"
    for name, comparison in found.drive:
        last, text = comparison.last, _AT_LEAST if comparison.last.saturated else _EXACTLY
        yield name.capitalize(), text.format(last=last, since=comparison)
    if found.trouble:
        yield "Drive", found.trouble


def _minute_text(found: CountersNow) -> str:
    line, own = found.line_minute, found.total.minute
    return (
        f"line {line.good} of {line.replies} replies good;"
        f" this drive {own.good} of {own.replies + own.silent} replies good;"
        f" {line.foreign} foreign frames, {line.strays} strays"
    )
