"""The life of a keeper, from its start to its end; tui.bus.share.keeper_share has its line."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from contextlib import closing
from dataclasses import replace
from functools import partial

import msgspec

from tui.bus.line import Line, timing_of
from tui.bus.line_events import LineEvent, NoticeReceived
from tui.bus.link import parse_link
from tui.bus.model import LineStatus
from tui.bus.program import KEEPER
from tui.bus.share.beside import FRAMES_KEPT
from tui.bus.share.keeper_share import CARE_INTERVAL, KeeperShare, Keeping
from tui.bus.share.keeping import KeeperOrder
from tui.bus.share.messages import VERSION
from tui.bus.share.sharing import KEEPER_STARTS
from tui.session.connect.recorded_line import record_line
from tui.session.connect.share_place import this_program
from tui.session.event_notes import EventNotes
from tui.session.events import EventLog
from tui.session.journal import Journal
from tui.session.logs import start_logging
from tui.session.sharing.orphan_motors import OrphanMotorGuard
from tui.session.signals import wait_for

ENDING_SIGNALS = ("SIGTERM", "SIGINT", "SIGQUIT")
IGNORED_SIGNALS = ("SIGHUP", "SIGUSR1", "SIGUSR2", "SIGTSTP", "SIGTTIN", "SIGTTOU")
"""Signals that end or suspend a process by default; a keeper goes on."""

LEAVE_TIME = 10.0
"""Seconds that programs have to stop their motors and leave when a keeper must end."""
STOP_TIME = 60.0
"""Seconds that motors have to stop when a keeper must end."""
LOST_TIME = 2.0
"""The same on a line that is lost."""


class Keeper:
    """Holds one line until no program needs it, and stops motors of programs that have exited."""

    def __init__(self, order: KeeperOrder, lock: int) -> None:
        self._ended = threading.Event()
        self._ordered = False
        """True once a signal has ordered the end."""
        alarm = partial(signal.setitimer, signal.ITIMER_REAL)
        keeping = Keeping(lock, order.before, self._ended.set, self.cares, alarm)
        link = parse_link(order.line)
        self._line = Line(
            link,
            timing=replace(timing_of(link), trace_length=FRAMES_KEPT),
            place=order.place,
            program=this_program(KEEPER),
            share=partial(KeeperShare, keeping),
            gated=True,
        )
        self._recorder = record_line(self._line, order.place.name)
        self._journal = Journal()
        self._guardian = OrphanMotorGuard(self._line, self._journal)
        self._events = EventLog()
        EventNotes(self._line.facts, self._events)
        self._line.facts.events.subscribe(self._hear)

    def cares(self) -> bool:
        """True while a motor is still to be stopped."""
        return self._guardian.busy

    def _hear(self, event: LineEvent) -> None:
        """Leave a notice for the next program if none on the line keeps it."""
        match event:
            case NoticeReceived(device, text) if not self._line.facts.others:
                self._events.add("told", text, device or None)

    def end(self) -> None:
        """End soon: the computer may be shut down, and programs that are attached end as well."""
        self._ordered = True
        self._ended.set()

    def work(self) -> None:
        """Hold the line until the end."""
        with closing(self._journal), closing(self._guardian):
            self._line.open()
            self._until_unneeded()
            self._line.close()
        if self._recorder is not None:
            self._recorder.close()

    def _until_unneeded(self) -> None:
        """Return when this keeper is to end, and no motor is still to be stopped.

        Programs that stay start the next keeper.
        """
        wait_for(self._ended)
        while self._line.facts.others and not self._ordered:
            self._ended.clear()  # a program attached in the meantime
            wait_for(self._ended)
        begun = time.monotonic()
        while self._is_needed(time.monotonic() - begun):
            time.sleep(CARE_INTERVAL)

    def _is_needed(self, waited: float) -> bool:
        """True while something is to be waited for; a line that stays lost is not, for long."""
        lost = self._line.state.status is not LineStatus.CONNECTED
        others = self._line.facts.others  # before the look at those that have just gone
        if self.cares() and waited < (LOST_TIME if lost else STOP_TIME):
            return True
        return bool(others) and self._ordered and waited < LEAVE_TIME


def main() -> None:
    """Keep the line that standard input describes; the lock is inherited."""
    order = msgspec.json.decode(sys.stdin.buffer.read(), type=KeeperOrder)
    if order.version != VERSION:
        sys.exit("the program that starts this keeper has another version")  # it holds the line
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), sys.stdin.fileno())
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    for name in IGNORED_SIGNALS:
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # ends the process whose line's loop hangs
    signal.setitimer(signal.ITIMER_REAL, KEEPER_STARTS)  # and one that never begins
    start_logging(0)
    keeper = Keeper(order, int(sys.argv[1]))
    for name in ENDING_SIGNALS:
        signal.signal(getattr(signal, name), lambda *_: keeper.end())
    keeper.work()
