"""One round of `chaos`: a program ends, and the record of the line shows what follows."""

from __future__ import annotations

import os
import random
import re
import signal
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

from benchmarks.chaos_line import EVERY, TIMEOUT, LineRecord, Stage, wrong_values
from benchmarks.keeper import keeper_of
from tests.line.pty_panel import LINE_SETTLED
from tests.programs import PATIENCE

FROZEN = 2.0
"""Seconds without a heartbeat after which a program counts as gone, for a new keeper too."""
KEYS = {"Ctrl-C": "\x03", "Ctrl-Z": "\x1a", "Ctrl-\\": "\x1c"}
MOTOR = ("run", "panel")
KILLED, CLOSED, THAWED, EXIT = "kill -9", "terminal closed", "SIGSTOP, SIGCONT", "exit"
DEAD_FROZEN, CRASH, LEFT_RUNNING = "SIGSTOP, kill -9", "error in drawing", "--leave-running"
COMMON = (EXIT, *KEYS, KILLED, DEAD_FROZEN, THAWED, CLOSED)
WITH_KEEPER, BESIDE = "kill -9 with its keeper", " beside a panel"
REPORTED = re.compile(r"not stopped|runs since|runs on|left running|state is not known", re.I)
"""Text of a program or a log about a motor that keeps running."""


@dataclass(slots=True)
class Outcome:
    """Result of one round; times in s from the end of the program."""

    number: int
    program: str
    end: str
    line: str
    due: float | None = None
    """Until when the stop has to be on the wire; None if no stop is due."""
    stop: float | None = None
    gap: float = 0.0
    wrong: int = 0
    unreported: int = 0
    left: int = 0
    broken: list[str] = field(default_factory=list)
    """Requirements that were not met, in words."""
    failed: str = ""
    """Why the round could not be played to its end."""


class HasMotor(Protocol):
    """Program that runs the motor of a round."""

    def send(self, number: signal.Signals) -> None:
        """Send it a signal, if it lives."""

    def ends_within(self, seconds: float) -> bool:
        """Wait for its end; False if it still lives."""
        ...


class Round:
    """One round, from its line to what is left."""

    stage_of: Callable[[int], Stage] = Stage
    """Makes the line of a round, by its baud rate; 0 is Modbus TCP."""

    def __init__(self, outcome: Outcome, chance: random.Random, after: float, slack: float) -> None:
        self._outcome, self._chance, self._after, self._slack = outcome, chance, after, slack
        self._end = outcome.end.removesuffix(BESIDE)
        self._beside = outcome.end.endswith(BESIDE)
        self._owner: HasMotor

    def play(self) -> None:
        """Play it, and judge it."""
        line = self._outcome.line
        with closing(self.stage_of(int(line) if line.isdigit() else 0)) as self._stage:
            try:
                self._begin()
                self._finish()
            except AssertionError as late:
                self._outcome.failed = f"{late}: {self._stage.programs[-1].picture}"
            finally:
                self._end_all()

    def _begin(self) -> None:
        """Start the programs, in one order or the other."""
        stage, program = self._stage, self._outcome.program
        observed_first = self._chance.random() < 0.5
        if observed_first:
            stage.observe()
        motor = program if program in MOTOR else self._chance.choice(MOTOR)
        extra = {("run", EXIT): ("--for", "3"), ("run", LEFT_RUNNING): (LEFT_RUNNING,)}
        module = "benchmarks.broken_panel" if self._end == CRASH else "tui"
        words = extra.get((program, self._end), ())
        self._owner = self._victim = stage.start_motor(motor, *words, module=module)
        self._ready = time.time()
        if not observed_first:
            stage.observe()
        if self._beside:
            stage.start("LINE", "-d", "1").shows("FORWARD")
        if program in ("watch", "backup"):
            count = ("--count", "5") if self._end == EXIT else ()
            words = ("RFR", "--every", "0.2", *count)
            more = words if program == "watch" else (str(stage.folder / "set"),)
            self._ready = time.time()
            self._victim = stage.start(program, "LINE", *more, "-d", "2", "-p", "atv71")

    def _end_victim(self) -> tuple[float, float | None, bool]:
        """End the victim. Return when, the deadline of a stop (None: none is due), and True if the
        motor must run.
        """
        outcome, victim, end = self._outcome, self._victim, self._end
        mine = outcome.program in MOTOR
        gone = TIMEOUT if self._beside else 0.0
        if outcome.program == "keeper":
            return self._end_keeper()
        if end == EXIT:
            return self._leave()
        begun = time.time()
        if end in KEYS:
            victim.press(KEYS[end])
            if end == "Ctrl-Z" and not victim.withstands(signal.SIGTSTP):
                outcome.broken.append("a shell suspends it")
            ends = outcome.program == "run" and end != "Ctrl-Z"
            return begun, 0.0 if ends else None, not ends
        if end == CRASH:
            method = self._chance.choice(("put", "draw_frame"))
            return self._stage.fail_drawing(method), 0.0, False
        if end == WITH_KEEPER:
            self._end_keeper()
            victim.send(signal.SIGKILL)
            return begun, FROZEN, False
        if end in (DEAD_FROZEN, THAWED):
            victim.send(signal.SIGSTOP)
            time.sleep(pause := self._chance.uniform(0.2, 8.0))
            victim.send(signal.SIGKILL if end == DEAD_FROZEN else signal.SIGCONT)
            frozen = max(FROZEN, gone) if pause > FROZEN else pause + gone
            if end == DEAD_FROZEN:
                return begun, frozen if mine else None, not mine
            stays = mine and pause > frozen + self._slack
            return begun, frozen if stays else None, not mine or pause < FROZEN / 2
        if end == KILLED or (end == LEFT_RUNNING and self._chance.random() < 0.5):
            victim.send(signal.SIGKILL)
        else:
            begun = victim.hang_up()
        must_run = not mine or end == LEFT_RUNNING
        return begun, None if must_run else gone, must_run

    def _leave(self) -> tuple[float, float | None, bool]:
        victim = self._victim
        if self._outcome.program == "panel":
            victim.press("q")
            victim.shows("A motor runs by your command")
            time.sleep(LINE_SETTLED)
            begun = time.time()
            victim.press("s")
            return begun, 0.0, False
        victim.ends_within(PATIENCE)
        if self._outcome.program == "run":
            return self._stage.line.record().stop_after(self._ready) or time.time(), 0.0, False
        return time.time(), None, True

    def _end_keeper(self) -> tuple[float, float | None, bool]:
        pid = keeper_of(self._stage.state)
        assert pid is not None, "the keeper is not there"
        begun = time.time()
        by_end = {KILLED: signal.SIGKILL, WITH_KEEPER: signal.SIGKILL, "SIGTERM": signal.SIGTERM}
        os.kill(pid, first := by_end.get(self._end, signal.SIGSTOP))
        if first is signal.SIGSTOP:
            time.sleep(self._chance.uniform(0.2, 8.0))
            number = signal.SIGKILL if self._end == DEAD_FROZEN else signal.SIGCONT
            self._stage.send(pid, number)
        return begun, None, first is not signal.SIGSTOP

    def _finish(self) -> None:
        outcome = self._outcome
        time.sleep(max(0.0, self._ready + self._chance.uniform(0.0, 4.0) - time.time()))
        begun, outcome.due, must_run = self._end_victim()
        time.sleep(max(0.0, begun + self._after - time.time()))
        record = self._stage.line.record()
        stop = record.stop_after(begun)
        outcome.stop = stop - begun if stop else None
        self._judge_values(record, begun)
        if outcome.due is not None:
            self._judge_stop(record, stop)
        elif must_run and (stop or not record.turns(time.time())):
            outcome.broken.append("the motor was stopped")
        if record.started_after(stop):
            outcome.broken.append("the motor was started again")
        if outcome.due is None and outcome.end != LEFT_RUNNING:
            self._stop_in_order()

    def _judge_stop(self, record: LineRecord, stop: float | None) -> None:
        outcome = self._outcome
        if stop is None:
            outcome.broken.append("no stop" + "; the drive tripped" * record.moments[-1].fault)
        elif outcome.stop and outcome.stop > (outcome.due or 0.0) + self._slack:
            outcome.broken.append(f"stop after {outcome.stop:.1f} s")
        self._judge_report(record)

    def _judge_report(self, record: LineRecord) -> None:
        """A motor that turns yet has to be reported somewhere."""
        if record.turns(time.time()) and not REPORTED.search(self._stage.output()):
            self._outcome.unreported = 1
            self._outcome.broken.append("the motor turns, unreported")

    def _judge_values(self, record: LineRecord, begun: float) -> None:
        outcome, observer = self._outcome, self._stage.observer
        assert observer is not None
        around = [value for value in observer.good() if value > begun - 2 * EVERY]
        last = time.time() - around[-1] if around else self._after
        outcome.gap = max([last, *(b - a for a, b in pairwise(around))])
        if last > 5.0:
            outcome.broken.append(f"no value for the last {last:.0f} s")
        outcome.wrong = len(found := wrong_values(observer, record))
        outcome.broken += sorted(set(found))

    def _stop_in_order(self) -> None:
        """A motor that may run on has to obey the end of its program."""
        begun = time.time()
        self._owner.send(signal.SIGTERM)
        if not self._owner.ends_within(30.0):
            self._outcome.broken.append("the program with the motor does not end")
        time.sleep(0.5)
        record = self._stage.line.record()
        if record.turns(time.time()):
            self._outcome.broken.append("the motor turns after the end of its program")
            self._judge_report(record)
        elif record.turns(begun) and record.stop_after(begun) is None:
            self._outcome.broken.append("no stop at the end of its program")

    def _end_all(self) -> None:
        """End the programs; what is left of them 15 s later is a fault."""
        if not self._stage.end_programs():
            self._outcome.broken.append("a program does not end")
        self._outcome.left = self._stage.left()
        self._outcome.broken += ["a process is left"] * self._outcome.left
