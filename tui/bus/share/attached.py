"""A program that is attached to the owner of a line, as the owner knows it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import partial

from tui.safety import COMMAND_TOO_LATE, SILENT_CLIENT, STOP_DUE

from ..bounds import MOST_FRAMES
from ..errors import RequestRefused
from ..limits import CAUTIOUS, Limits
from ..line_events import EventHub, WriteAbandoned
from ..model import DeviceCounters, DeviceState, Priority, Reply
from ..program import Program
from ..schedule.inside import LineInside
from ..schedule.queue import Job
from .carried import error_form, request_from
from .messages import (
    Alive,
    Answer,
    AnyMessage,
    Asking,
    Failed,
    News,
    NoMessage,
    packed,
)
from .owner_watch import is_stop

log = logging.getLogger(__name__)

MOST_REQUESTED = 256
"""Requests of one client that may wait."""
MOST_UNREAD = 1 << 23
"""Most unread bytes of a client; one that stalls is disconnected, and may attach again."""


@dataclass(eq=False, slots=True)
class Client:
    """One attached program."""

    program: Program
    writer: asyncio.StreamWriter
    events: EventHub
    shares: dict[int, float] = field(default_factory=dict)
    trace: bool = False
    frames: int = 0
    """Number of frames of the line sent to it."""
    limits: dict[int, Limits] = field(default_factory=dict)
    stops_left: list[Job] = field(default_factory=list)
    """Stops that it had requested when it left."""
    stops_due: dict[int, float] = field(default_factory=dict)
    """Time of its stops, by device, until the device has answered a stop word of it."""
    requested: dict[int, Job] = field(default_factory=dict)
    known: dict[int, DeviceState] = field(default_factory=dict)
    counted: Mapping[int, DeviceCounters] = field(default_factory=dict)
    heard: float = 0.0
    """When its last message came."""
    looks: int = 0
    """Number of checks without a heartbeat since the last one."""

    def say(self, message: AnyMessage) -> None:
        """Send it a message; never waits."""
        transport = self.writer.transport
        if transport.is_closing():
            return
        if self.unread > MOST_UNREAD:
            log.warning("%s no longer reads and is disconnected", self.program.text)
            transport.abort()
            return
        self.writer.write(packed(message))

    @property
    def unread(self) -> int:
        """Bytes that wait until it reads on."""
        return self.writer.transport.get_write_buffer_size()

    def due_stops(self, now: float) -> tuple[int, ...]:
        """Devices that it has stopped recently, and that have answered no stop word of it."""
        return tuple(number for number, when in self.stops_due.items() if now - when < STOP_DUE)

    def hears(self, message: AnyMessage, now: float) -> None:
        """Note a message of it; a stop is acknowledged on receipt."""
        self.heard, self.looks = now, 0
        if is_stop(message):
            self.say(Alive())

    def is_silent(self, now: float, looks: int) -> bool:
        """True if it sent no heartbeat for too long, in time and in checks.

        The number of checks counts too: if this program was delayed itself, the client may be well.
        """
        self.looks += 1
        return now - self.heard > SILENT_CLIENT and self.looks > looks

    def drop(self) -> None:
        """Disconnect it; it may attach again."""
        self.forget()
        self.writer.transport.abort()

    def forget(self) -> list[Job]:
        """Cancel its requests, except stops: they are sent although no program waits for them."""
        requested, self.requested = self.requested, {}
        for job in requested.values():
            if job.request.changes and (job.begun or job.priority is Priority.STOP):
                self.events.emit(WriteAbandoned(self.program, job.request, job.answer))
            if job.priority is Priority.STOP:
                self.stops_left.append(job)
            else:
                job.answer.cancel()
        return self.stops_left

    def ask(self, inside: LineInside, message: Asking) -> None:
        """Pass a request of the program to the line. Raises NoMessage."""
        if len(self.requested) >= MOST_REQUESTED:
            raise NoMessage("too many requests at once")
        try:
            request = request_from(message.kind, message.fields)
        except ValueError as error:
            raise NoMessage(str(error)) from error
        priority = message.priority
        limits = message.limits or self.limits.get(request.device, CAUTIOUS)
        job = Job(request, priority, limits, replaceable=message.replaceable)
        job.program, job.stamp = self.program.id, message.stamp
        job.max_age, job.requested = message.max_age, message.requested
        job.within = message.within
        self.requested[message.number] = job
        job.answer.add_done_callback(partial(self._answered, message.number))
        late = inside.clock() - message.requested
        if job.commands and late > COMMAND_TOO_LATE:
            job.fail(RequestRefused(was_suspended(late)))
        else:
            inside.submit(job)

    def _answered(self, number: int, answer: Future[Reply]) -> None:
        job = self.requested.pop(number, None)
        if job is None or answer.cancelled():
            return
        error = answer.exception()
        if error is None and job.priority is Priority.STOP and job.request.changes:
            self.stops_due.pop(job.request.device, None)
        if error is not None:
            self.say(Failed(number, error_form(error)))
        else:
            reply = answer.result()
            self.say(Answer(number, reply.pdu, reply.time))

    def withdraw(self, number: int) -> None:
        """Cancel a request that it no longer waits for."""
        job = self.requested.get(number)
        if job is not None:
            job.answer.cancel()

    def news(self, inside: LineInside, shares: dict[int, float]) -> News:
        """Return the news of the line for it."""
        changed = {}
        for device in inside.devices.known:
            state = inside.devices.state(device)
            if self.known.get(device) != state:
                self.known[device] = changed[device] = state
        count = inside.around.trace.count
        new = min(count - self.frames, MOST_FRAMES) if self.trace else 0
        frames = inside.around.trace.frames()[-new:] if new else ()
        self.frames = count
        counters = inside.around.tally.frozen()
        counted = {
            d: device_counters
            for d, device_counters in counters.devices.items()
            if self.counted.get(d) != device_counters
        }
        self.counted = counters.devices
        plain = replace(counters, devices={})
        error = inside.error()
        failure = error_form(error) if error is not None else None
        return News(
            inside.state(), plain, changed, shares, failure, frames, counted, inside.pace.stretch
        )


def was_suspended(seconds: float) -> str:
    """Why a command is not sent, for a person."""
    return f"Not sent: the program that owns the line was suspended for {seconds:.0f} s."
