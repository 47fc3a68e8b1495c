"""Publication of a program's actions to the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..line_events import ControlDenied
from .beside import send_plain_stop
from .messages import AnyMessage, Armed, Claim, PollPause

if TYPE_CHECKING:
    from ..shared_state import SharedState


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


def tell_own(facts: SharedState, send: Callable[[AnyMessage], None]) -> None:
    """Send the holder of a line what this program has armed, commands, keeps alive or pauses.

    For drives that it had armed before, the care for them.
    """
    me = facts.me.id
    for device, lease in facts.leases.of(me).items():
        send(Armed(device, lease.stamp, lease.until, lease.care))
    for alive in facts.keep_alives.of(me):
        send(alive)
    for device, holder in facts.commanders.items():
        if holder == me:
            send(Claim(device, True))
    for device, (program, why) in facts.paused.items():
        if program == me:
            send(PollPause(device, why))


def give_up_own(facts: SharedState, why: str) -> None:
    """Give up all drives: this program counted as exited."""
    me = facts.me.id
    for device in facts.leases.of(me):
        facts.leases.disarm(device)
    for device, holder in facts.commanders.items():
        if holder == me:
            facts.release(device)
            facts.events.emit(ControlDenied(device, why))
