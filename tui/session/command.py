"""Commanding one drive: armed first, interlocked, walked through its chart, seen to obey.

Methods may be called from any thread and return at once; the work is done in the line's loop,
and `outcome` tells what it has come to. A stop needs none of this: see stop.py.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Collection, Coroutine, Mapping
from dataclasses import dataclass
from decimal import Decimal
from enum import StrEnum
from typing import Any

from tui.bus.errors import LineError, Superseded
from tui.bus.line import LineStatus, Priority
from tui.drive.chart import read_chart, state_of
from tui.drive.errors import DriveError
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    deciding_codes,
    interlock,
    interlock_codes,
    target,
    walk,
    with_options,
)
from tui.drive.schema import Chart, CommandOption, ControlSource, Order, OrderId, State
from tui.drive.values import from_words

from .control_source import configure
from .drive_session import DriveSession
from .journal import Journal
from .order_queue import BY_STOP
from .order_queue import Order as Queued
from .readings import Reading
from .reference import Reference, parse_reference, reference_codes
from .writing import Writer

ARMED_FOR = 60.0
"""Seconds without a key after which a drive is no longer armed."""
STEP_TIME = 2.0
"""Seconds that a drive may take for one step of its chart."""
LOOK = 0.05
LOOKS = 10
"""Looks within which the direction of a start must be the ordered one."""
ENABLED = "enabled"
"""The state of the Drivecom charts in which the motor runs."""


Work = Callable[[], Coroutine[Any, Any, str]]
"""An order; it returns what was done."""


class Kind(StrEnum):
    """What an outcome is."""

    WORKING = "working"
    DONE = "done"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of the last order; `time` is time.monotonic()."""

    kind: Kind
    text: str
    time: float
    error: Exception | None = None
    """What was refused, and by whom."""


class Commander:
    """Gives orders to one drive, once it is armed."""

    def __init__(self, session: DriveSession, journal: Journal) -> None:
        self.session = session
        self.outcome: Outcome | None = None
        self._writer = Writer(session, journal)
        self._armed_until: float | None = None
        self._ended = ""
        self._wanted: Reference | None = None
        self._written: dict[str, int] = {}
        self._lock = threading.Lock()
        self._steps = Decimal(0)
        self._stepping = False

    # Arming

    def arm(self) -> None:
        """Let orders through from now on. Raises OrderRefused."""
        if self.session.line.read_only:
            raise OrderRefused("The line is read-only: nothing is written.")
        latest = self.session.monitor.latest
        if latest is None or latest.error or latest.state.kind == "unknown":
            raise OrderRefused("The state of the drive is not known; nothing is commanded.")
        self._armed_until = time.monotonic() + ARMED_FOR
        self._ended = ""

    def disarm(self, why: str = "") -> None:
        """Let no order through any more."""
        self._armed_until = None
        self._ended = why

    def touch(self) -> None:
        """A key was pressed: an armed drive stays armed."""
        if self.armed_for is not None:
            self._armed_until = time.monotonic() + ARMED_FOR

    @property
    def armed_for(self) -> float | None:
        """Seconds for which the drive is armed yet; None when it is not."""
        if self._armed_until is None:
            return None
        left = self._armed_until - time.monotonic()
        if left <= 0:
            self.disarm("No key for a minute: no longer armed.")
        elif self.session.line.state.status is not LineStatus.CONNECTED:
            self.disarm("The line was lost: no longer armed.")
        return left if self._armed_until is not None else None

    @property
    def why_disarmed(self) -> str:
        """Why arming ended by itself, or nothing."""
        return self._ended

    # Orders

    def order(self, id: OrderId) -> None:
        """Give an order. Raises OrderRefused when the drive is not armed."""
        self._begin(lambda: self._carry_out(id))

    def refer(self, text: str) -> None:
        """Give a reference as typed: 30, 30Hz, 900rpm. Raises OrderRefused when not armed."""
        self._begin(lambda: self._refer(text))

    def step(self, hertz: Decimal) -> None:
        """Raise or lower the reference. Raises OrderRefused when not armed."""
        with self._lock:
            self._steps += hertz
            if self._stepping:
                return
            self._stepping = True
        try:
            self._begin(self._step)
        except OrderRefused:
            self._take_steps()
            raise

    def choose_option(self, option: CommandOption, bits: int) -> None:
        """Set an option. Raises OrderRefused when not armed."""
        self._begin(lambda: self._option(option, bits))

    def configure(self, source: ControlSource) -> None:
        """Set up who commands the drive. Raises OrderRefused when not armed."""

        async def work() -> str:
            done = await configure(self.session, self._writer, source)
            # words of another channel say nothing any more
            self._written = {}
            return done

        self._begin(work)

    def lost_orders(self) -> str:
        """What the drive no longer holds of what was written from here, or nothing."""
        known = self.session.monitor.known.raws()
        lost = [
            f"{code} 16#{raw:04X} is now 16#{known[code] & 0xFFFF:04X}"
            for code, raw in self._written.items()
            if code in known and known[code] & 0xFFFF != raw
        ]
        if not lost:
            return ""
        return f"Reset, switched off or commanded by others: {', '.join(lost)}."

    def _begin(self, work: Work) -> None:
        """Carry out an order behind those before it."""
        if self.armed_for is None:
            raise OrderRefused("Not armed: a arms this drive.")
        self.touch()
        self.session.orders.put(Queued(lambda: self._one(work), self._dropped))

    async def _one(self, work: Work) -> None:
        """One order; where it fails, those behind it are not carried out."""
        try:
            self._say(Kind.DONE, await work())
        except Superseded:
            return
        except (LineError, DriveError) as error:
            dropped = self.session.orders.drop("an order before it was refused")
            rest = " The orders behind it were dropped." if dropped else ""
            self._take_steps()
            self._say(Kind.REFUSED, f"{error}{rest}", error)
        except asyncio.CancelledError:
            self._dropped(BY_STOP)
            raise
        finally:
            self.session.monitor.refresh()

    def _dropped(self, why: str) -> None:
        self._take_steps()
        self._say(Kind.REFUSED, why)

    def refuse(self, text: str) -> None:
        """Tell why an order was not given."""
        self._say(Kind.REFUSED, text)

    def _say(self, kind: Kind, text: str, error: Exception | None = None) -> None:
        self.outcome = Outcome(kind, text, time.monotonic(), error)

    async def _carry_out(self, id: OrderId) -> str:
        chart = await self._chart()
        raws = self._raws()
        if refused := interlock(chart, id, raws):
            raise OrderRefused(refused)
        if id in ("forward", "reverse"):
            return await self._run(chart, id)
        order = choose(chart, id, raws)
        await self._send(chart, order)
        return f"{order.name}: {await self._reached(chart)}"

    async def _chart(self) -> Chart:
        """The chart in force, with every word read anew that an order depends on."""
        session = self.session
        codes = deciding_codes(session.profile)
        for chart in session.profile.data.charts:
            codes += [chart.status, chart.command, *interlock_codes(chart)]
        await self._read([code for code in dict.fromkeys(codes) if code])
        found = chart_in_force(session.profile, self._raws())
        if found is None or not found.orders:
            name = found.name if found else "what decides about its commands was not read"
            raise OrderRefused(f"This drive is not commanded from here: {name}.")
        return found

    async def _read(self, codes: list[str]) -> Mapping[str, Reading]:
        session = self.session
        readings = await session.monitor.reader.read(codes, priority=Priority.OPERATOR_READ)
        session.monitor.known.note(readings)
        return readings

    def _raws(self) -> dict[str, int]:
        return self.session.monitor.known.raws()

    async def _run(self, chart: Chart, id: OrderId) -> str:
        """Reference first, then the way through the chart to the running state."""
        same = [order for order in chart.orders if order.id == id]
        if not same:
            raise OrderRefused(f"The {chart.name} has no order {id!r}.")
        at_rest = (await self._state(chart)).kind not in ("running", "stopping")
        await self._write_reference_again()
        if chart.kind == "drivecom":
            await self._walk(chart, same[0])
        else:
            order = choose(chart, id, self._raws())
            await self._send(chart, order)
        name = same[0].name
        reached = await self._until_running(chart)
        if at_rest:
            await self._check_direction(chart, id)
        return f"{name}: {reached}"

    async def _check_direction(self, chart: Chart, id: OrderId) -> None:
        """Stop a motor that starts the other way: bit 11 may be assigned to something else."""
        turns = read_chart(self.session.profile, self._raws()).direction
        if turns is None or turns == id:
            return
        for _ in range(LOOKS):
            await asyncio.sleep(LOOK)
            await self._read([chart.direction.parameter] if chart.direction else [])
            turns = read_chart(self.session.profile, self._raws()).direction
            if turns == id:
                return
        await self._send(chart, choose(chart, "stop", self._raws()))
        raise OrderRefused(
            f"Ordered {id}, the drive turned {turns} and was stopped: its reverse order is"
            " assigned to something else."
        )

    async def _write_reference_again(self) -> None:
        """Some drives run only once their reference was written, too: it is, as it stands."""
        parameter = self.session.profile.quantity("command_frequency")
        if self._wanted is not None:
            parameter = self._wanted.parameter
        if parameter is None:
            return
        reading = (await self._read([parameter.code]))[parameter.code]
        raw = self._wanted.raw if self._wanted is not None else reading.raw
        if raw is not None:
            await self._writer.write(parameter, raw, why="reference before the run order")
            self.session.note_command()

    async def _walk(self, chart: Chart, run: Order) -> None:
        """From the state now to the running one, each state seen before the next command."""
        state = await self._state(chart)
        if state.kind == "fault":
            raise OrderRefused("The drive is in fault: reset it first.")
        way = walk(chart, state.id, ENABLED)
        for goal, word in way:
            last = goal == ENABLED
            await self._write_command(chart, run.words[-1] if last else word, run.name)
            reached = await self._wait(chart, {goal, ENABLED})
            if reached.id not in (goal, ENABLED):
                names = {s.id: s.name for s in chart.states}
                raise OrderRefused(
                    f"The drive stays in {reached.name} and does not go to {names[goal]}"
                    f" on 16#{word:04X}."
                )
        if not way:
            await self._write_command(chart, run.words[-1], run.name)

    async def _send(self, chart: Chart, order: Order) -> None:
        parameter = target(self.session.profile, chart, order)
        for word in with_options(chart, order, self._raws()):
            if parameter.code == chart.command:
                await self._write_command(chart, word, order.name)
            else:
                await self._writer.write(parameter, from_words(parameter, [word]), why=order.name)

    async def _write_command(self, chart: Chart, word: int, why: str) -> None:
        parameter = self.session.profile[chart.command]
        # the state of the drive tells whether it was taken; the word itself is kept on record
        await self._writer.write(parameter, from_words(parameter, [word]), why=why, check=0)
        self.session.note_command()
        self._written = {parameter.code: word}
        self.session.monitor.also = (parameter.code,)

    async def _state(self, chart: Chart) -> State:
        await self._read([chart.status])
        return state_of(chart, self._raws()[chart.status])

    async def _wait(self, chart: Chart, goals: Collection[str]) -> State:
        """The state, as soon as it is one of those, or when its time is up."""
        end = time.monotonic() + STEP_TIME
        state = await self._state(chart)
        while state.id not in goals and time.monotonic() < end:
            await asyncio.sleep(LOOK)
            state = await self._state(chart)
        return state

    async def _reached(self, chart: Chart) -> str:
        return (await self._state(chart)).name

    async def _until_running(self, chart: Chart) -> str:
        state = await self._wait(chart, {s.id for s in chart.states if s.kind == "running"})
        if state.kind != "running":
            raise OrderRefused(f"The drive does not run; it is in the state {state.name}.")
        return state.name

    # References and options

    async def _refer(self, text: str) -> str:
        readings = await self._read(reference_codes(self.session.profile))
        return await self._give(parse_reference(self.session.profile, text, readings))

    def _take_steps(self) -> Decimal:
        """The steps that were ordered and not yet given."""
        with self._lock:
            steps, self._steps, self._stepping = self._steps, Decimal(0), False
        return steps

    async def _step(self) -> str:
        hertz = self._take_steps()
        profile = self.session.profile
        readings = await self._read(reference_codes(profile))
        parameter = profile.quantity("command_frequency")
        reading = readings.get(parameter.code) if parameter else None
        if reading is None or reading.value is None or reading.value.number is None:
            raise OrderRefused(f"Where {profile.name} takes its reference is not known.")
        number = max(Decimal(0), reading.value.number + hertz)
        return await self._give(parse_reference(profile, f"{number:f}Hz", readings))

    async def _give(self, reference: Reference) -> str:
        await self._writer.write(
            reference.parameter, reference.raw, why="reference", replaceable=True
        )
        self.session.note_command()
        self._wanted = reference
        rounded = ", rounded to what the drive can hold" if reference.rounded else ""
        return f"Reference {reference.text} ({reference.parameter.code}){rounded}"

    async def _option(self, option: CommandOption, bits: int) -> str:
        parameter = self.session.profile[option.parameter]
        chart = await self._chart()
        reading = (await self._read([parameter.code]))[parameter.code]
        if reading.raw is None:
            raise OrderRefused(f"{parameter.code} cannot be read: {reading.error}")
        running = {state.id for state in chart.states if state.kind in ("running", "stopping")}
        if option.stopped_only and (await self._state(chart)).id in running:
            raise OrderRefused(f"{option.name} is changed with the motor stopped only.")
        word = reading.raw & 0xFFFF & ~option.mask | bits
        await self._writer.write(
            parameter, from_words(parameter, [word]), why=option.name, check=option.mask
        )
        self.session.note_command()
        if parameter.code in self._written:
            self._written[parameter.code] = word
        name = next(choice.name for choice in option.choices if choice.bits == bits)
        return f"{option.name}: {name}"
