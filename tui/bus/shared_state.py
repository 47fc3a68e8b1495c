"""State shared by all programs on one line: programs, commanders, stops.

A line that is not shared has such state too: then this program is the only one.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from .bounds import MOST_NOTICE, MOST_TEXT
from .errors import stopped_first_text
from .keep_alive import KeepAlives
from .leases import WriteLeases
from .line_events import (
    ControlAnswered,
    DevicesStopped,
    EventHub,
    LineEvent,
    NoticeReceived,
    ProgramLost,
    ProgramsChanged,
)
from .model import EndedExchange
from .notes import Notes
from .program import KEEPER, Program
from .share.beside import send_plain_stop
from .share.messages import (
    AnyMessage,
    Claim,
    DriveRequested,
    Facts,
    Notified,
    PollPause,
    RequestGranted,
    StopGiven,
)
from .stop_counts import StopCounts

DEPARTED_KEPT = 16
"""Number of departed programs that are remembered."""


@dataclass(eq=False, slots=True)
class LinePublisher:
    """Connection to the other programs on a line; used in any thread."""

    send: Callable[[AnyMessage], None]
    """Has a message handed on to them."""
    holder: str = ""
    """The socket of another program that holds the line; empty if this one does."""

    def stop_directly(self, devices: tuple[int, ...]) -> None:
        """Have another holder of the line stop devices, without the loop of this program.

        Raises OSError; waits for a moment at most.
        """
        if self.holder:
            send_plain_stop(Path(self.holder), devices)


class SharedState:
    """The facts of one line. May be used from any thread; mappings are replaced, never changed."""

    def __init__(self, me: Program | None = None) -> None:
        self.me = me or Program("here", "drivepanel", os.getpid())
        self.simulated_as = ""
        """LINE of simulated drives, whose link is a temporary one; empty for other lines."""
        self.programs: tuple[Program, ...] = (self.me,)
        """All on the line, the owner first."""
        self.commanders: Mapping[int, str] = MappingProxyType({})
        """Ids of the programs that command, by device."""
        self.paused: Mapping[int, tuple[str, str]] = MappingProxyType({})
        """Devices whose polling is paused: by which program, and why."""
        self.stops = StopCounts()
        """Stops given to each device, by all programs."""
        self.leases = WriteLeases(self.me.id, self.stops, self._tell)
        """Which program may write to which device."""
        self.keep_alives = KeepAlives(self.me.id, self._tell)
        """Which devices are kept from their communication timeout."""
        self.notes = Notes(self._tell)
        """Notes for the next program on the line."""
        self.unkept = ""
        """Reason if this program holds the line although a keeper should; else empty."""
        self.gated = False
        """True if only armed devices may be written on the line."""
        self.events = EventHub()
        """Passes on what happens on the line."""
        self.record: Callable[[EndedExchange], object] | None = None
        """Called in the line's thread with each exchange of this program; must not wait."""
        self.accepts_care: Callable[[int, bytes], bool] = accepts_any_care
        """True if this program can stop a device by the care for it, should it hold the line.

        Called in the line's thread; set by what stops the motors of other programs.
        """
        self.departed: tuple[Program, ...] = ()
        """Programs that have left the line, the last ones last."""
        self.voice: LinePublisher | None = None
        """None while there is no other program to send to."""
        self._lock = threading.RLock()
        self.events.subscribe(self._end_pauses)

    # Programs

    @property
    def others(self) -> tuple[Program, ...]:
        """The other programs on the line, without its keeper."""
        mine = self.me.id
        return tuple(
            program for program in self.programs if program.id != mine and program.name != KEEPER
        )

    def program(self, id: str) -> Program | None:
        """A program on the line."""
        return next((item for item in self.programs if item.id == id), None)

    def learn(self, reported: Facts) -> tuple[int, ...]:
        """Take over the owner's message; what this program claims is its own until denied.

        Returns the devices with stops that this program did not know of.
        """
        self.stops.learn_times(reported.stopped)
        with self._lock:
            others = {d: text for d, text in reported.commanders.items() if text != self.me.id}
            mine = {d: text for d, text in self.commanders.items() if text == self.me.id}
            theirs = {d: pair for d, pair in reported.paused.items() if pair[0] != self.me.id}
            own = {d: pair for d, pair in self.paused.items() if pair[0] == self.me.id}
            self.paused = MappingProxyType({**theirs, **own})
            self.commanders = MappingProxyType({**others, **mine})
            unheard = self.stops.replace(reported.stops, self.me.id)
            known = {program.id for program in (*self.departed, *reported.programs, self.me)}
            earlier = tuple(program for program in reported.departed if program.id not in known)
            self.departed = (*earlier, *self.departed)[-DEPARTED_KEPT:]
        self.leases.forget_ended(others)
        self.set_programs(reported.programs)
        return unheard

    def set_programs(self, programs: tuple[Program, ...]) -> None:
        """The programs on the line, as their owner knows them."""
        with self._lock:
            here = {program.id for program in programs}
            left = [
                program
                for program in self.programs
                if program.id not in here and program.id != self.me.id
            ]
            stay = [program for program in self.departed if program.id not in here]
            self.departed = (*stay, *left)[-DEPARTED_KEPT:]
            self.programs = programs
        self.events.emit(ProgramsChanged())

    # Notices to all

    def tell_all(self, device: int, text: str) -> None:
        """Have every program on the line show its person a message about a device."""
        self.events.emit(NoticeReceived(device, text))
        self._tell(Notified(device, text[:MOST_TEXT]))

    def _tell(self, message: AnyMessage) -> None:
        """Send an action of this program to the other programs, if there are any; in any thread."""
        if (voice := self.voice) is not None:
            voice.send(message)

    # Pauses of polling

    def pause_polling(self, device: int, why: str) -> None:
        """Pause all requests to a device except those of a stop."""
        self.note_pause(device, self.me.id, why)
        self._tell(PollPause(device, why[:MOST_NOTICE]))

    def resume_polling(self, device: int) -> None:
        """Resume the requests to a device."""
        self.note_pause(device, self.me.id, "")
        self._tell(PollPause(device, ""))

    def note_pause(self, device: int, program: str, why: str) -> None:
        """A program leaves a device alone, or with no reason no longer."""
        with self._lock:
            rest = {d: pair for d, pair in self.paused.items() if d != device}
            self.paused = MappingProxyType({**rest, device: (program, why)} if why else rest)

    def _end_pauses(self, event: LineEvent) -> None:
        """A stop ends a pause of polling: the device is read until it is at standstill."""
        if isinstance(event, DevicesStopped):
            for device in event.devices:
                self.note_pause(device, "", "")

    # Stops

    def give_stop(self, devices: Iterable[int], by: str) -> None:
        """Stop devices: earlier commands to them are canceled in all programs."""
        stopped = tuple(devices)
        # count first, then send: a program that attaches in between reports the counts
        self.stops.give(self.me.id, stopped, by)
        for device in stopped:
            self.note_pause(device, "", "")
        when = max(self.stops.times.get(number, 0.0) for number in stopped) if stopped else None
        counts = self.stops.of(self.me.id, stopped)
        self._tell(StopGiven(stopped, counts, by[:MOST_TEXT], self.me, when))

    # Who commands

    def commander(self, device: int) -> Program | None:
        """The other program that commands a device; None if there is none."""
        holder = self.commanders.get(device)
        return None if holder in (None, self.me.id) else self.program(holder or "")

    def claim(self, device: int) -> str:
        """Take command of a device; returns the reason if refused, else nothing."""
        with self._lock:
            if (other := self.commander(device)) is not None:
                return commanded_by(device, other)
            self.note_commander(device, self.me.id)
        self._tell(Claim(device, True))
        return ""

    def release(self, device: int) -> None:
        """Command a device no longer."""
        with self._lock:
            if self.commanders.get(device) != self.me.id:
                return
            self.note_commander(device, None)
        self._tell(Claim(device, False))

    def note_commander(self, device: int, program: str | None) -> None:
        """A program commands a device; None: nobody does."""
        with self._lock:
            if self.commanders.get(device) == program:
                return
            held = {d: text for d, text in self.commanders.items() if d != device}
            if program is not None:
                held[device] = program
            self.commanders = MappingProxyType(held)
        self.events.emit(ProgramsChanged())

    # Taking over

    def ask_for(self, device: int) -> None:
        """Ask the program that commands a device to leave it."""
        self._tell(DriveRequested(device, self.me))

    def answer(self, device: int, program: str, *, yes: bool, why: str = "") -> None:
        """Answer a program that requested a device which this program commands."""
        if yes:
            self.release(device)
        self._tell(RequestGranted(device, program, yes, why[:MOST_TEXT]))

    def hear_reply(self, device: int, why: str, *, yes: bool) -> None:
        """The program that commands a device has answered."""
        if yes:
            self.note_commander(device, None)
        self.events.emit(ControlAnswered(device, yes, why))

    # Programs that have left

    def hear_gone(self, program: Program) -> None:
        """Forget a program that has left the line; called in the owner only."""
        with self._lock:
            held = {d: text for d, text in self.commanders.items() if text != program.id}
            self.commanders = MappingProxyType(held)
            left = {d: pair for d, pair in self.paused.items() if pair[0] != program.id}
            self.paused = MappingProxyType(left)
            rest = tuple(item for item in self.programs if item.id != program.id)
        self.leases.end(program.id)
        self.keep_alives.end(program.id)
        self.set_programs(rest)
        self.events.emit(ProgramLost(program))

    # Permission to send

    def refusal(self, program: str, device: int, stamp: int, *, writes: bool = False) -> str:
        """Reason if a program's write to a device must no longer be sent; else empty.

        `stamp` is the count of stops that the program knew when it handed the write over. `writes`
        is True if the request writes registers.
        """
        if stamp != self.stops.stamp(device):
            return stopped_first_text(self.stops.by.get(device, ""))
        for commander in (device,) if device else tuple(self.commanders):
            holder = self.commanders.get(commander)
            if holder is not None and holder != program:
                other = self.program(holder)
                if other is not None:
                    return commanded_by(commander, other)
        return self.leases.refusal(program, device) if writes and self.gated else ""


def accepts_any_care(_device: int, _care: bytes) -> bool:
    """Accept any care, in a program that stops no motors of others."""
    return True


def commanded_by(device: int, other: Program) -> str:
    """That another program commands a device, for a person."""
    return f"Drive {device} is commanded by {other.text}."
