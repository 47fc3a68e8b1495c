"""`drivepanel listen`: what others say on a line, in drives, codes and values."""

from __future__ import annotations

import os
import shlex
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

import click

from tui.bus.errors import LineError
from tui.bus.listening_line import ListeningLine
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.capture_file import CaptureFile
from tui.session.connect.address_prober import known_profiles
from tui.session.listening.background import (
    CannotListen,
    PlaceToListen,
    PortListener,
    line_to_listen,
)
from tui.session.listening.families import Families, remembered_families
from tui.session.listening.listener import DecodedExchange
from tui.session.signals import BY_SIGNAL, signal_name
from tui.wire.capture.forms import READ_RAW
from tui.wire.observed.splitting import ObservedFrame

from ..shared.completion import complete_line, complete_profile
from ..shared.errors import INTERRUPTED, LINE_TROUBLE, Failure, file_failures
from ..shared.line_argument import LineArgument
from ..shared.listen_outputs import ListenJsonOutput, ListenNoOutput, ListenOutput, ListenTextOutput
from ..shared.numbers import seconds
from ..shared.options import json_option
from ..shared.registration import command
from ..shared.say import say
from ..shared.signals import interrupted_by_signal, never_suspended
from ..shared.standard_streams import STANDARD

PROGRAM_NAME = "listen"
LAST_ADDRESS_HEARD = 255


@command("Monitor traffic on a line; send nothing.", group="Troubleshoot", statuses=(LINE_TROUBLE,))
@click.argument("line_text", metavar="LINE", cls=LineArgument, shell_complete=complete_line)
@click.option(
    "-p",
    "--profile",
    "profile_ids",
    multiple=True,
    metavar="[ADDRESS=]ID",
    shell_complete=complete_profile,
    help="Use this profile for all drives, or for one; repeatable.",
)
@click.option(
    "--pcap",
    "pcap_path",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write the frames to a pcapng file as Modbus/TCP.",
)
@click.option(
    "--raw",
    is_flag=True,
    help="Write RTU frames with checksum, and show tshark options.",
)
@click.option("--force", is_flag=True, help="Replace a file that exists.")
@click.option(
    "--every",
    type=seconds(1.0),
    metavar="S",
    help="Show the summary every S seconds too.",
)
@click.option(
    "--for",
    "seconds",
    type=seconds(above=True),
    metavar="S",
    help="Listen for S seconds, else until Ctrl-C.",
)
@json_option
def listen(
    line_text: str,
    profile_ids: tuple[str, ...],
    pcap_path: Path | None,
    raw: bool,
    force: bool,
    every: float | None,
    seconds: float | None,
    as_json: bool,
) -> None:
    """Monitor the traffic of other masters on a serial line, and send nothing.

    Requests and replies of any master are shown by drive, code and value. A summary at the end
    shows which master commands which drive, how often each is polled, and what goes wrong. The port
    is opened for reading only, and for this program alone. A sim: LINE has a simulated master.
    """
    if pcap_path is None and (raw or force):
        raise click.UsageError("--raw and --force require --pcap FILE.")
    to_output = pcap_path == STANDARD
    if to_output and as_json:
        raise click.UsageError("Either --pcap - or --json: both write to standard output.")
    named = profiles_named(profile_ids)
    with (
        never_suspended(),
        interrupted_by_signal() as came,
        _serial_line(line_to_listen(line_text, PROGRAM_NAME)) as place,
    ):
        families = Families(known_profiles(), named, remembered_families(place.line.link))
        output: ListenOutput = (
            ListenJsonOutput(line_text, families) if as_json else ListenTextOutput(families)
        )
        if to_output:
            output = ListenNoOutput()
        file = _opened_file(pcap_path, line_text, raw=raw, force=force)
        listening = HearingRun(place.line, families, output, file)
        try:
            if not as_json:
                _say_begin(place.line.link.path, pcap_path if raw else None, err=to_output)
            place.begin()
            listening.run(seconds, every)
        except LineError:
            listening.end()
            raise
        except KeyboardInterrupt:
            listening.end()
            by = signal_name(came[0]) if came else "Ctrl-C"
            status = BY_SIGNAL + came[0] if came else INTERRUPTED
            raise Failure(f"Ended by {by}. {listening.text}", status) from None
        finally:
            if file is not None:
                file.close()
        listening.end()
    if not as_json:
        say(listening.text, err=to_output)


@contextmanager
def _serial_line(
    opening: AbstractContextManager[PlaceToListen],
) -> Iterator[PlaceToListen]:
    """The line that is meant; raises UsageError if it is not a serial line."""
    with ExitStack() as stack:
        try:
            place = stack.enter_context(opening)
        except CannotListen as error:
            raise click.UsageError(str(error)) from None
        yield place


def profiles_named(given: tuple[str, ...]) -> dict[int | None, Profile]:
    """Profiles by address, with None for that of all others; raises UsageError, UnknownProfile."""
    found: dict[int | None, Profile] = {}
    for text in given:
        address, sign, profile_id = text.rpartition("=")
        if sign and not (address.isdecimal() and 1 <= int(address) <= LAST_ADDRESS_HEARD):
            raise click.UsageError(f"{text!r}: write ID, or ADDRESS=ID such as 2=ID.")
        device = int(address) if sign else None
        if device in found:
            raise click.UsageError(f"{text!r}: one profile for each address.")
        found[device] = library.load(profile_id)
    return found


def _opened_file(path: Path | None, line: str, *, raw: bool, force: bool) -> CaptureFile | None:
    """The capture file; None without --pcap. Raises Failure if it cannot be written."""
    if path is None:
        return None
    with file_failures(path):
        output = os.fdopen(os.dup(1), "wb", buffering=0) if path == STANDARD else None
        return CaptureFile(path, line, raw=raw, force=force, output=output)


def _say_begin(port: str, raw_file: Path | None, *, err: bool) -> None:
    say(f"Listening at {port}; nothing is sent. Ctrl-C ends it.", err=err)
    if raw_file is not None:
        say("To read the file:", err=err)
        say(READ_RAW.replace("FILE", shlex.quote(str(raw_file))), to_copy=True, err=err)


class HearingRun:
    """Passes traffic to an output and a file, and summarizes it."""

    def __init__(
        self,
        line: ListeningLine,
        families: Families,
        output: ListenOutput,
        file: CaptureFile | None = None,
    ) -> None:
        self._output = output
        self._file = file
        self._wall = time.time() - time.monotonic()
        """Offset from the monotonic clock to seconds since 1970."""
        self._listener = PortListener(line, families, self._tell, self._keep)

    @property
    def text(self) -> str:
        """Summary of the traffic and of the files, in a sentence."""
        tally = self._listener.listener.tally
        text = f"Heard {tally.exchanges} exchanges in {tally.frames} frames"
        if self._file is None:
            return f"{text}."
        return f"{text}; {self._file.packets} packets written to {self._file.path}."

    def run(self, seconds: float | None, every: float | None) -> None:
        """Listen for so long, or until Ctrl-C. Raises LineLost, and Failure for the file."""
        begun = time.monotonic()
        until = float("inf") if seconds is None else begun + seconds
        next_sum = float("inf") if every is None else begun + every
        while (now := time.monotonic()) < until:
            if now >= next_sum:
                self._sum_up(now)
                next_sum += every or 0.0
            left = min(until, next_sum) - now
            self._listener.take(*self._listener.read(left))

    def end(self) -> None:
        """Report open requests, and the summary."""
        now = time.monotonic()
        self._listener.end(now)
        self._sum_up(now)

    def _tell(self, exchange: DecodedExchange) -> None:
        self._output.exchange(exchange, exchange.exchange.time + self._wall)

    def _sum_up(self, now: float) -> None:
        self._output.summary(self._listener.summary(now), now + self._wall)

    def _keep(self, frame: ObservedFrame, request: bool | None) -> None:
        """Write a frame to the file, if there is one."""
        if self._file is None:
            return
        wall = frame.ended + self._wall
        with file_failures(self._file.path):
            if request is None:
                self._file.add_noise(frame.data, wall)
            else:
                self._file.add_frame(frame.device, frame.pdu, wall, request=request)
