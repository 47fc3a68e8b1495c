"""Commanding one drive: armed first, interlocked, walked through its chart, seen to obey.

Methods may be called from any thread and return at once; the work is done in the line's loop, and
`outcome` holds its result. A stop needs none of this: see stop.py.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from decimal import Decimal
from typing import Any

from tui.drive.orders import OrderRefused, deciding_codes
from tui.drive.profile.schema import CommandOption, ControlSource, OrderId
from tui.safety import ARMED_FOR, STATE_FRESH

from ..drive import DriveSession
from ..journal import Journal
from ..read.reader import Reader
from ..starts.keeper import NothingToTakeOver
from ..work import Outcome, OutcomeKind, Permit, Task
from .access import CommandAccess
from .carry_out import (
    check_run,
    give_order,
    give_reference,
    run_at_reference,
    set_option,
    step_reference,
)
from .command_history import CommandHistory
from .control_source import configure

CommandWork = Callable[[CommandAccess], Coroutine[Any, Any, str]]
"""A command; it returns what was done."""


class Commander:
    """Gives commands to one drive, once it is armed."""

    def __init__(self, session: DriveSession, journal: Journal) -> None:
        self.session = session
        self.journal = journal
        self.last_run: tuple[OrderId, str | None] | None = None
        """The run command that was given last, with its reference."""
        self.given = CommandHistory(session)
        """Commands given by this program, and whether the drive still holds them."""
        self._lock = threading.Lock()
        self._steps = Decimal(0)
        self._stepping = False

    @property
    def outcome(self) -> Outcome | None:
        """Result of the last work on the drive."""
        return self.session.work.outcome

    # Arming

    def arm(self, *, seconds: float = ARMED_FOR, stamp: int | None = None) -> None:
        """Let commands through from now on; a state that is not fresh is read first.

        `stamp` is the count of stops when that was asked for: a stop since is the last word.
        Raises OrderRefused where the line is read-only or lost, or the drive is not to be armed.
        """
        session = self.session
        requested = session.work.stops if stamp is None else stamp
        refused = session.line.read_only or bool(session.arming.barred)
        if refused or session.state(STATE_FRESH).kind != "unknown":
            session.work.arm(requested, seconds)
            return

        async def work(_permit: Permit) -> str:
            charts = session.profile.data.charts
            codes = [*deciding_codes(session.profile), *(chart.status for chart in charts)]
            await Reader(session).read(dict.fromkeys(codes))
            if session.state(STATE_FRESH).kind == "unknown":
                raise OrderRefused("The state of the drive is not known; nothing is commanded.")
            session.work.arm(requested, seconds)
            return ""

        session.work.put(Task(work, owner=self, armed=False))

    def disarm(self, why: str = "") -> None:
        """Let no command through any more."""
        self.session.arming.disarm(why)

    @property
    def armed_for(self) -> float | None:
        """Seconds for which the drive is armed yet; None when it is not."""
        return self.session.arming.armed_for

    # Commands; `stamp` is the count of stops when they were typed

    def order(self, id: OrderId, stamp: int | None = None) -> None:
        """Give a command. Raises OrderRefused when the drive is not armed."""
        self._begin(lambda access: give_order(access, id), stamp)

    def run(self, id: OrderId, reference: str | None = None, stamp: int | None = None) -> None:
        """Run forward or reverse at a typed reference, or at the present one.

        Raises OrderRefused when the drive is not armed.
        """
        self.last_run = (id, reference)
        self._begin(lambda access: run_at_reference(access, id, reference), stamp)

    def check_run(self, id: OrderId, reference: str | None = None) -> None:
        """Check all that a run depends on, as if the line had the control; write nothing.

        Raises OrderRefused when the drive is not armed.
        """
        self._begin(lambda access: check_run(access, id, reference), None)

    def refer(self, text: str, stamp: int | None = None) -> None:
        """Give a reference as typed: 30, 30Hz, 900rpm, 40%. Raises OrderRefused when not armed."""
        self._begin(lambda access: give_reference(access, text), stamp)

    def step(self, hertz: Decimal, stamp: int | None = None) -> None:
        """Raise or lower the reference. Raises OrderRefused when not armed."""
        with self._lock:
            self._steps += hertz
            if self._stepping:
                return
            self._stepping = True
        try:
            self._begin(lambda access: step_reference(access, self._take_steps()), stamp)
        except OrderRefused:
            self._take_steps()
            raise

    def choose_option(self, option: CommandOption, bits: int, stamp: int | None = None) -> None:
        """Set an option. Raises OrderRefused when not armed."""
        self._begin(lambda access: set_option(access, option, bits), stamp)

    def take_over(self, stamp: int | None = None) -> None:
        """Look after a motor that an earlier program has started; no frame is sent.

        Raises OrderRefused when not armed.
        """
        session = self.session

        async def work(_access: CommandAccess) -> str:
            if session.starts is None:
                raise NothingToTakeOver("Starts of motors are not put on record here.")
            await asyncio.to_thread(session.starts.take_over, session)
            session.note_command()
            return "Taken over. On leaving you are asked what happens to the motor."

        self._begin(work, stamp)

    def configure(self, source: ControlSource, stamp: int | None = None) -> None:
        """Set up who commands the drive. Raises OrderRefused when not armed."""

        async def work(access: CommandAccess) -> str:
            done = await configure(self.session, access.writer, source)
            self.given.forget_words()
            return done

        self._begin(work, stamp)

    def refuse(self, text: str) -> None:
        """Report why a command was not given."""
        self.session.work.tell(OutcomeKind.REFUSED, text)

    def _take_steps(self) -> Decimal:
        """The steps that were ordered and not yet given."""
        with self._lock:
            steps, self._steps, self._stepping = self._steps, Decimal(0), False
        return steps

    def _begin(self, work: CommandWork, stamp: int | None) -> None:
        """Carry out a command behind those before it."""

        async def carry_out(permit: Permit) -> str:
            return await work(CommandAccess(self.session, self.journal, self.given, permit))

        task = Task(carry_out, owner=self, given_up=self._give_up)
        self.session.work.put(task, stamp)
        self.session.arming.touch()

    def _give_up(self) -> None:
        """Steps that were not given are forgotten."""
        self._take_steps()
