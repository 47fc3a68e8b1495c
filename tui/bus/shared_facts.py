"""What all programs on one line must know of each other: who is there, who commands, who stopped.

A line that nobody shares has such facts too: then this program is the only one.
"""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Protocol, TypeVar

import msgspec

from .stop_counts import GivenStops, StopCounts

log = logging.getLogger(__name__)

T = TypeVar("T")


class Program(msgspec.Struct, frozen=True):
    """A program on the line, as others name it."""

    id: str
    """Its own among all programs."""
    name: str
    """`panel`, `run` and the like."""
    pid: int = 0
    user: str = ""
    where: str = ""
    """Its terminal; empty where that is unknown."""

    @property
    def text(self) -> str:
        """How people are told of it: `panel on pts/3 (pid 812)`."""
        where = f" on {self.where}" if self.where else ""
        return f"{self.name}{where} (pid {self.pid})"


class Voice(Protocol):
    """Carries what is done here to the other programs; called in any thread."""

    def stop_given(self, devices: tuple[int, ...], by: str) -> None:
        """Devices are stopped from here."""

    def claim(self, device: int, take: bool) -> None:
        """This program commands a device now, or no longer."""

    def ask(self, device: int) -> None:
        """This program wants a device that another one commands."""

    def reply(self, device: int, program: str, yes: bool, why: str) -> None:
        """The answer to a program that asked."""

    def told(self, device: int, text: str) -> None:
        """Something that everybody on the line is to read."""


StopListener = Callable[[tuple[int, ...], str, Program], None]
DeniedListener = Callable[[int, str], None]
QuestionListener = Callable[[int, Program], None]
ReplyListener = Callable[[int, bool, str], None]
GoneListener = Callable[[Program], None]
TextListener = Callable[[int, str], None]
ChangeListener = Callable[[], None]
DEPARTED_KEPT = 16


class SharedFacts:
    """The facts of one line. May be used from any thread; mappings are replaced, never changed.

    Listeners are called in the line's thread.
    """

    def __init__(self, me: Program | None = None) -> None:
        self.me = me or Program("here", "drivepanel", os.getpid())
        self.programs: tuple[Program, ...] = (self.me,)
        """All on the line, the owner first."""
        self.commanders: Mapping[int, str] = MappingProxyType({})
        """Ids of the programs that command, by device."""
        self.stops = StopCounts()
        """How many stops each device was given, by all programs."""
        self.untold: tuple[int, ...] = ()
        """Devices stopped from here while nobody could be told."""
        self.departed: tuple[Program, ...] = ()
        """Programs that have left the line, the last ones last."""
        self.voice: Voice | None = None
        """None while nobody else hears of it."""
        self._lock = threading.RLock()
        self._on_stop: list[StopListener] = []
        self._on_denied: list[DeniedListener] = []
        self._on_question: list[QuestionListener] = []
        self._on_reply: list[ReplyListener] = []
        self._on_gone: list[GoneListener] = []
        self._on_text: list[TextListener] = []
        self._on_change: list[ChangeListener] = []

    # Who is there

    @property
    def others(self) -> tuple[Program, ...]:
        """The other programs on the line."""
        return tuple(one for one in self.programs if one.id != self.me.id)

    def program(self, id: str) -> Program | None:
        """A program on the line."""
        return next((one for one in self.programs if one.id == id), None)

    def learn(
        self, programs: tuple[Program, ...], commanders: Mapping[int, str], given: GivenStops
    ) -> tuple[int, ...]:
        """Take over what the owner tells; what this program claims is its own until denied.

        Returns the devices of which stops are told that this program had not heard of.
        """
        with self._lock:
            others = {d: one for d, one in commanders.items() if one != self.me.id}
            mine = {d: one for d, one in self.commanders.items() if one == self.me.id}
            self.commanders = MappingProxyType({**others, **mine})
            unheard = self.stops.replace(given, self.me.id)
        self.set_programs(programs)
        return unheard

    def set_programs(self, programs: tuple[Program, ...]) -> None:
        """The programs on the line, as their owner knows them."""
        with self._lock:
            here = {one.id for one in programs}
            left = [one for one in self.programs if one.id not in here and one.id != self.me.id]
            stay = [one for one in self.departed if one.id not in here]
            self.departed = (*stay, *left)[-DEPARTED_KEPT:]
            self.programs = programs
        self._changed()

    def on_change(self, listener: ChangeListener) -> Callable[[], None]:
        """Call `listener` when programs or commanders are others than before."""
        return _subscribed(self._on_change, listener)

    def _changed(self) -> None:
        for listener in tuple(self._on_change):
            _told(listener)

    # What all are to read

    def tell_all(self, device: int, text: str) -> None:
        """Have every program on the line tell its person something about a device."""
        self.hear_text(device, text)
        if self.voice is not None:
            self.voice.told(device, text)

    def on_text(self, listener: TextListener) -> Callable[[], None]:
        """Call `listener` with what is to be read about a device."""
        return _subscribed(self._on_text, listener)

    def hear_text(self, device: int, text: str) -> None:
        """Something is to be read."""
        for listener in tuple(self._on_text):
            _told(listener, device, text)

    # Stops

    def give_stop(self, devices: Iterable[int], by: str) -> None:
        """Devices are stopped from here: what was meant for them before is void everywhere."""
        stopped = tuple(devices)
        with self._lock:
            self.stops.give(self.me.id, stopped, by)
            voice = self.voice
            if voice is None:
                self.untold = tuple(dict.fromkeys((*self.untold, *stopped)))
        if voice is not None:
            voice.stop_given(stopped, by)

    def find_voice(self, voice: Voice) -> tuple[int, ...]:
        """From now on others hear of what is done here.

        Returns the devices that were stopped while nobody could hear of it.
        """
        with self._lock:
            self.voice = voice
            untold, self.untold = self.untold, ()
            return untold

    def on_stop(self, listener: StopListener) -> Callable[[], None]:
        """Call `listener` when another program stops devices; returns how to end that."""
        return _subscribed(self._on_stop, listener)

    def hear_stop(self, devices: tuple[int, ...], by: str, program: Program) -> None:
        """Another program has stopped devices."""
        for listener in tuple(self._on_stop):
            _told(listener, devices, by, program)

    # Who commands

    def commander(self, device: int) -> Program | None:
        """The other program that commands a device; None where none does, or this one."""
        holder = self.commanders.get(device)
        return None if holder in (None, self.me.id) else self.program(holder or "")

    def claim(self, device: int) -> str:
        """Command a device from here; returns why not, or nothing."""
        with self._lock:
            if (other := self.commander(device)) is not None:
                return commanded_by(device, other)
            self.note_commander(device, self.me.id)
        if self.voice is not None:
            self.voice.claim(device, True)
        return ""

    def release(self, device: int) -> None:
        """Command a device no longer."""
        with self._lock:
            if self.commanders.get(device) != self.me.id:
                return
            self.note_commander(device, None)
        if self.voice is not None:
            self.voice.claim(device, False)

    def note_commander(self, device: int, program: str | None) -> None:
        """A program commands a device; None: nobody does."""
        with self._lock:
            if self.commanders.get(device) == program:
                return
            held = {d: one for d, one in self.commanders.items() if d != device}
            if program is not None:
                held[device] = program
            self.commanders = MappingProxyType(held)
        self._changed()

    def on_denied(self, listener: DeniedListener) -> Callable[[], None]:
        """Call `listener` with device and reason when a claim was refused or ended."""
        return _subscribed(self._on_denied, listener)

    def hear_denied(self, device: int, why: str) -> None:
        """What this program claimed is not, or no longer, its own."""
        for listener in tuple(self._on_denied):
            _told(listener, device, why)

    # Taking over

    def ask_for(self, device: int) -> None:
        """Ask the program that commands a device to leave it."""
        if self.voice is not None:
            self.voice.ask(device)

    def answer(self, device: int, program: str, *, yes: bool, why: str = "") -> None:
        """Answer a program that asked for a device which is commanded from here."""
        if yes:
            self.release(device)
        if self.voice is not None:
            self.voice.reply(device, program, yes, why)

    def on_question(self, listener: QuestionListener) -> Callable[[], None]:
        """Call `listener` when a program asks for a device that is commanded from here."""
        return _subscribed(self._on_question, listener)

    def hear_question(self, device: int, program: Program) -> None:
        """A program asks for a device that is commanded from here."""
        for listener in tuple(self._on_question):
            _told(listener, device, program)

    def on_reply(self, listener: ReplyListener) -> Callable[[], None]:
        """Call `listener` with device, yes or no, and why, when a question was answered."""
        return _subscribed(self._on_reply, listener)

    def hear_reply(self, device: int, why: str, *, yes: bool) -> None:
        """The program that commands a device has answered."""
        if yes:
            self.note_commander(device, None)
        for listener in tuple(self._on_reply):
            _told(listener, device, yes, why)

    # Programs that went away

    def on_gone(self, listener: GoneListener) -> Callable[[], None]:
        """Call `listener`, in the owner only, when a program left without saying so, or ended."""
        return _subscribed(self._on_gone, listener)

    def hear_gone(self, program: Program) -> None:
        """A program is on the line no more; called where this program owns it."""
        with self._lock:
            held = {d: one for d, one in self.commanders.items() if one != program.id}
            self.commanders = MappingProxyType(held)
            rest = tuple(one for one in self.programs if one.id != program.id)
        self.set_programs(rest)
        for listener in tuple(self._on_gone):
            _told(listener, program)

    # What may go out

    def refusal(self, program: str, device: int, stamp: int) -> str:
        """Why a program's write to a device must not go out any more; empty where it may.

        `stamp` is the count of stops that the program knew when it handed the write over.
        """
        if stamp != self.stops.stamp(device):
            by = self.stops.by.get(device, "")
            return f"Not sent: a stop came after it{f' ({by})' if by else ''}."
        for one in (device,) if device else tuple(self.commanders):
            holder = self.commanders.get(one)
            if holder is not None and holder != program:
                other = self.program(holder)
                if other is not None:
                    return commanded_by(one, other)
        return ""


def commanded_by(device: int, other: Program) -> str:
    """That another program commands a device, for a person."""
    return f"Drive {device} is commanded by {other.text}."


def _subscribed(listeners: list[T], listener: T) -> Callable[[], None]:
    listeners.append(listener)

    def leave() -> None:
        if listener in listeners:
            listeners.remove(listener)

    return leave


def _told(listener: Callable[..., None], *what: object) -> None:
    try:
        listener(*what)
    except Exception:
        # a listener's fault is not the line's
        log.exception("a listener of the shared line failed")
