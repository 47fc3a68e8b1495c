"""How what is done in one program reaches the others; called in any thread."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..bounds import MOST_NOTICE, MOST_TEXT
from ..keep_alive import KeepAlive
from ..leases import WriteLease
from ..notes import LineNote
from ..shared_facts import SharedFacts
from .messages import (
    AnyMessage,
    Armed,
    AskedFor,
    Claim,
    Granting,
    Hush,
    StopGiven,
    Told,
)
from .plain_stop import send_plain_stop


class ProgramVoice:
    """Makes messages of it for whoever hands them on; `send` may be called in any thread.

    `holder` is the socket of another program that holds the line.
    """

    def __init__(
        self, facts: SharedFacts, send: Callable[[AnyMessage], None], holder: str = ""
    ) -> None:
        self._holder = holder
        self._facts = facts
        self._send = send

    def stop_given(self, devices: tuple[int, ...], by: str) -> None:
        """Devices are stopped by this program."""
        me, stops = self._facts.me, self._facts.stops
        when = max(stops.times.get(one, 0.0) for one in devices) if devices else None
        self._send(StopGiven(devices, stops.of(me.id, devices), by[:MOST_TEXT], me, when))

    def stop_directly(self, devices: tuple[int, ...]) -> None:
        """Have another holder of the line stop devices; raises OSError, waits a moment at most."""
        if self._holder:
            send_plain_stop(Path(self._holder), devices)

    def claim(self, device: int, take: bool) -> None:
        """This program commands a device now, or no longer."""
        self._send(Claim(device, take))

    def ask(self, device: int) -> None:
        """This program wants a device that another one commands."""
        self._send(AskedFor(device, self._facts.me))

    def reply(self, device: int, program: str, yes: bool, why: str) -> None:
        """This program answers one that asked."""
        self._send(Granting(device, program, yes, why[:MOST_TEXT]))

    def hushed(self, device: int, why: str) -> None:
        """A device is left alone by this program, or with no reason no longer."""
        self._send(Hush(device, why[:MOST_NOTICE]))

    def armed(self, device: int, lease: WriteLease) -> None:
        """This program may write to a device until a time, or no more if that is over."""
        self._send(Armed(device, lease.stamp, lease.until, lease.care))

    def kept_alive(self, one: KeepAlive) -> None:
        """This program has a device kept alive, or no more."""
        self._send(one)

    def told(self, device: int, text: str) -> None:
        """This program has something for all to read."""
        self._send(Told(device, text[:MOST_TEXT]))

    def noted(self, note: LineNote) -> None:
        """This program leaves a note, or asks for some."""
        self._send(note)


def tell_own(facts: SharedFacts, send: Callable[[AnyMessage], None]) -> None:
    """Send the holder of a line what this program has armed, commands, keeps or leaves alone.

    Of drives that it has armed before, how to stop them.
    """
    me = facts.me.id
    for device, lease in facts.leases.of(me).items():
        send(Armed(device, lease.stamp, lease.until, lease.care))
    for one in facts.keep_alives.of(me):
        send(one)
    for device, holder in facts.commanders.items():
        if holder == me:
            send(Claim(device, True))
    for device, (program, why) in facts.hushed.items():
        if program == me:
            send(Hush(device, why))


def give_up_own(facts: SharedFacts, why: str) -> None:
    """Command and write to no drive any more: this program was taken for gone."""
    me = facts.me.id
    for device in facts.leases.of(me):
        facts.leases.disarm(device)
    for device, holder in facts.commanders.items():
        if holder == me:
            facts.release(device)
            facts.hear_denied(device, why)
