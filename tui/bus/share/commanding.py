"""Commander of each device, granted by the owner of the line; requests and answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from ..keep_alive import KeepAlive
from ..leases import WriteLease
from ..line_events import ControlRequested
from ..program import Program
from ..shared_state import SharedState, commanded_by
from .attached import Client
from .messages import (
    AnyMessage,
    Armed,
    Claim,
    DriveRequested,
    PollPause,
    RequestDenied,
    RequestGranted,
)


class Commanding:
    """Grants devices and passes requests on, for the programs of one line; in the line's loop."""

    def __init__(
        self,
        facts: SharedState,
        clients: Mapping[str, Client],
        tell_facts: Callable[[], None],
    ) -> None:
        self._facts = facts
        self._clients = clients
        self._tell_facts = tell_facts

    def hears(self, program: Program, message: AnyMessage) -> bool:
        """Carry out a message about a device, perhaps this program's; False for any other
        message."""
        facts = self._facts
        match message:
            case Claim():
                self.claimed(program, message)
            case DriveRequested(device=device):
                self.drive_requested(program, device)
            case RequestGranted():
                self.replied(program, message)
            case PollPause(device=device, why=why):
                facts.note_pause(device, program.id, why)
                self._tell_facts()
            case Armed():
                self._armed(program, message)
            case KeepAlive() if program.id != facts.me.id:
                facts.keep_alives.hear(program.id, message)
            case KeepAlive():
                pass  # known already
            case _:
                return False
        return True

    def _armed(self, program: Program, message: Armed) -> None:
        """Grant or end a lease; care that this program cannot use counts as none."""
        facts, device, care = self._facts, message.device, message.care
        lease = WriteLease(message.stamp, message.until, care)
        if not lease.has_ended:
            for client in self._clients.values():
                # the program that arms it now knows of that stop
                client.stops_due.pop(device, None)
        if program.id == facts.me.id:
            return  # granted already
        # one that commands it now knows better how to stop it than one that armed it before
        other = lease.has_ended and facts.commanders.get(device) not in (None, program.id)
        known = not care or other or facts.accepts_care(device, care)
        if lease.has_ended or not known:
            facts.leases.end(program.id, device)
        if not lease.has_ended:
            facts.leases.grant(program.id, device, lease if known else replace(lease, care=b""))

    def claimed(self, program: Program, claim: Claim) -> None:
        """A program wants to command a device, or no longer."""
        facts, device, take = self._facts, claim.device, claim.take
        holder = facts.commanders.get(device)
        if take and holder not in (None, program.id):
            other = facts.program(holder or "")
            client = self._clients.get(program.id)
            if other is not None and client is not None:
                client.say(RequestDenied(device, other))
                return
        if take or holder == program.id:
            facts.note_commander(device, program.id if take else None)
        self._tell_facts()

    def drive_requested(self, program: Program, device: int) -> None:
        """Hand a question on to the program that commands a device."""
        facts = self._facts
        holder = facts.commanders.get(device)
        if holder == facts.me.id:
            facts.events.emit(ControlRequested(device, program))
        elif holder is not None and (client := self._clients.get(holder)) is not None:
            client.say(DriveRequested(device, program))

    def replied(self, program: Program, reply: RequestGranted) -> None:
        """Pass an answer to the requesting program; a yes frees the device."""
        facts = self._facts
        if reply.yes and facts.commanders.get(reply.device) == program.id:
            facts.note_commander(reply.device, None)
            self._tell_facts()
        why = reply.why or ("" if reply.yes else commanded_by(reply.device, program))
        if reply.program == facts.me.id:
            facts.hear_reply(reply.device, why, yes=reply.yes)
        elif (client := self._clients.get(reply.program)) is not None:
            client.say(RequestGranted(reply.device, reply.program, reply.yes, why))
