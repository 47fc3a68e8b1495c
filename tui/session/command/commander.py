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
from typing import Any

from tui.bus.line import Priority
from tui.drive.chart import read_chart, state_of
from tui.drive.orders import (
    OrderRefused,
    chart_in_force,
    choose,
    deciding_codes,
    interlock,
    interlock_codes,
    order_target,
    walk,
    with_options,
)
from tui.drive.profile.schema import Chart, CommandOption, ControlSource, Order, OrderId, State
from tui.drive.values import from_words

from ..arming import ARMED_FOR
from ..drive import DriveSession
from ..drive_state import STATE_FRESH
from ..journal import Journal
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import Writer
from ..starts.keeper import NothingToTakeOver, record_start
from ..work import Outcome, OutcomeKind, Permit, Task
from .control_source import configure
from .reference import Reference, parse_reference, reference_codes, within_limits

STEP_TIME = 2.0
"""Seconds that a drive may take for one step of its chart."""
STATE_POLL_INTERVAL = 0.05
LOOKS = 10
"""Looks within which the direction of a start must be the ordered one."""
ENABLED = "enabled"
"""The state of the Drivecom charts in which the motor runs."""


CommandWork = Callable[["_Commands"], Coroutine[Any, Any, str]]
"""A command; it returns what was done."""


class Commander:
    """Gives commands to one drive, once it is armed."""

    def __init__(self, session: DriveSession, journal: Journal) -> None:
        self.session = session
        self.journal = journal
        self.last_run: tuple[OrderId, str | None] | None = None
        """The run command that was given last, with its reference."""
        self._wanted: Reference | None = None
        self._written: dict[str, int] = {}
        self._written_under = 0
        self._lock = threading.Lock()
        self._steps = Decimal(0)
        self._stepping = False

    @property
    def outcome(self) -> Outcome | None:
        """What the last work on the drive has come to."""
        return self.session.work.outcome

    # Arming

    def arm(self, *, seconds: float = ARMED_FOR) -> None:
        """Let commands through from now on; a state that is not fresh is read first.

        Raises OrderRefused where the line is read-only or lost.
        """
        session = self.session
        if session.line.read_only or session.state(STATE_FRESH).kind != "unknown":
            session.arming.arm(seconds=seconds)
            return
        stamp = session.work.stops

        async def work(_permit: Permit) -> str:
            charts = session.profile.data.charts
            codes = [*deciding_codes(session.profile), *(chart.status for chart in charts)]
            await Reader(session).read(dict.fromkeys(codes))
            if session.state(STATE_FRESH).kind == "unknown":
                raise OrderRefused("The state of the drive is not known; nothing is commanded.")
            if stamp == session.work.stops:
                session.arming.arm(seconds=seconds)
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
        self._begin(lambda do: do.carry_out(id), stamp)

    def run(self, id: OrderId, reference: str | None = None, stamp: int | None = None) -> None:
        """Run forward or reverse at a reference as typed, or at the one that stands.

        Raises OrderRefused when the drive is not armed.
        """
        self.last_run = (id, reference)
        self._begin(lambda do: do.run(id, reference), stamp)

    def refer(self, text: str, stamp: int | None = None) -> None:
        """Give a reference as typed: 30, 30Hz, 900rpm. Raises OrderRefused when not armed."""
        self._begin(lambda do: do.refer(text), stamp)

    def step(self, hertz: Decimal, stamp: int | None = None) -> None:
        """Raise or lower the reference. Raises OrderRefused when not armed."""
        with self._lock:
            self._steps += hertz
            if self._stepping:
                return
            self._stepping = True
        try:
            self._begin(lambda do: do.step(self.take_steps()), stamp)
        except OrderRefused:
            self.take_steps()
            raise

    def choose_option(self, option: CommandOption, bits: int, stamp: int | None = None) -> None:
        """Set an option. Raises OrderRefused when not armed."""
        self._begin(lambda do: do.option(option, bits), stamp)

    def take_over(self, stamp: int | None = None) -> None:
        """Look after a motor that an earlier program has started; no frame is sent.

        Raises OrderRefused when not armed.
        """
        session = self.session

        async def work(_do: _Commands) -> str:
            if session.starts is None:
                raise NothingToTakeOver("Starts of motors are not put on record here.")
            await asyncio.to_thread(session.starts.take_over, session)
            session.note_command()
            return "Taken over: leaving asks what becomes of the motor."

        self._begin(work, stamp)

    def configure(self, source: ControlSource, stamp: int | None = None) -> None:
        """Set up who commands the drive. Raises OrderRefused when not armed."""

        async def work(do: _Commands) -> str:
            done = await configure(self.session, do.writer, source)
            # words of another channel say nothing any more
            self._written = {}
            return done

        self._begin(work, stamp)

    def lost_orders(self) -> str:
        """What the drive no longer holds of what was written from here, or nothing.

        Nothing behind a stop from here, which wrote another word itself.
        """
        if self._written_under != self.session.work.stops:
            return ""
        lost = self.changed_words()
        return f"Reset, switched off or commanded by others: {lost}." if lost else ""

    def changed_words(self) -> str:
        """The command words that the drive holds otherwise than they were written from here."""
        known = self.session.image.raws
        return ", ".join(
            f"{code} 16#{raw:04X} is now 16#{known[code] & 0xFFFF:04X}"
            for code, raw in self._written.items()
            if code in known and known[code] & 0xFFFF != raw
        )

    def refuse(self, text: str) -> None:
        """Tell why a command was not given."""
        self.session.work.tell(OutcomeKind.REFUSED, text)

    def take_steps(self) -> Decimal:
        """The steps that were ordered and not yet given."""
        with self._lock:
            steps, self._steps, self._stepping = self._steps, Decimal(0), False
        return steps

    def _begin(self, work: CommandWork, stamp: int | None) -> None:
        """Carry out a command behind those before it."""

        async def carry_out(permit: Permit) -> str:
            return await work(_Commands(self, permit))

        task = Task(carry_out, owner=self, given_up=self._give_up)
        self.session.work.put(task, stamp)
        self.session.arming.touch()

    def _give_up(self) -> None:
        """Steps that were not given are forgotten."""
        self.take_steps()

    # What the commands keep from one to the next

    @property
    def wanted(self) -> Reference | None:
        """The reference that was given last."""
        return self._wanted

    def note_reference(self, reference: Reference) -> None:
        """A reference was given."""
        self._wanted = reference

    def note_command(self, code: str, word: int) -> None:
        """A command word was written: it is watched from now on."""
        self._written, self._written_under = {code: word}, self.session.work.stops
        self.session.followed = (code,)

    def note_option(self, code: str, word: int) -> None:
        """Option bits of a command word were written."""
        if code in self._written:
            self._written[code] = word


@dataclass(slots=True)
class _Commands:
    """The commands under one permit."""

    commander: Commander
    permit: Permit
    started: bool = False
    """Whether a run frame went out, or may have."""

    @property
    def session(self) -> DriveSession:
        """The drive that is commanded."""
        return self.commander.session

    @property
    def writer(self) -> Writer:
        """Writes as long as the permit holds."""
        return Writer(self.session, self.commander.journal, self.permit)

    async def carry_out(self, id: OrderId) -> str:
        chart = await self._chart()
        raws = self._raws()
        if refused := interlock(chart, id, raws):
            raise OrderRefused(refused)
        if id in ("forward", "reverse"):
            return await self._start(chart, id)
        order = choose(chart, id, raws)
        await self._send(chart, order)
        return f"{order.name}: {await self._reached(chart)}"

    async def run(self, id: OrderId, reference: str | None) -> str:
        """Reference and run command in one, once nothing speaks against the command."""
        chart = await self._chart()
        if refused := interlock(chart, id, self._raws()):
            raise OrderRefused(refused)
        if reference is not None:
            await self.refer(reference)
        return await self._start(chart, id)

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
        return await Reader(session).read(codes, priority=Priority.OPERATOR_READ)

    def _raws(self) -> Mapping[str, int]:
        return self.session.image.raws

    async def _start(self, chart: Chart, id: OrderId) -> str:
        """Reference first, then the way through the chart to the running state."""
        same = [order for order in chart.orders if order.id == id]
        if not same:
            raise OrderRefused(f"The {chart.name} has no order {id!r}.")
        at_rest = (await self._state(chart)).kind not in ("running", "stopping")
        await record_start(self.session, "reverse" if id == "reverse" else "forward", self.permit)
        try:
            await self._write_reference_again()
            if chart.kind == "drivecom":
                await self._walk(chart, same[0])
            else:
                order = choose(chart, id, self._raws())
                self._start_goes_out()
                await self._send(chart, order)
        finally:
            if not self.started and self.session.starts is not None:
                self.session.starts.never_sent(self.session)
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
            await asyncio.sleep(STATE_POLL_INTERVAL)
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
        if self.commander.wanted is not None:
            parameter = self.commander.wanted.parameter
        if parameter is None:
            return
        reading = (await self._read([parameter.code]))[parameter.code]
        raw = self.commander.wanted.raw if self.commander.wanted is not None else reading.raw
        if raw is not None:
            await self.writer.write(parameter, raw, why="reference before the run order")
            self.session.note_command()

    def _start_goes_out(self) -> None:
        """From here on a standstill says that the motor was stopped."""
        self.started = True
        if self.session.starts is not None:
            self.session.starts.sent(self.session)

    async def _walk(self, chart: Chart, run: Order) -> None:
        """From the state now to the running one, each state seen before the next command."""
        state = await self._state(chart)
        if state.kind == "fault":
            raise OrderRefused("The drive is in fault: reset it first.")
        way = walk(chart, state.id, ENABLED)
        for goal, word in way:
            last = goal == ENABLED
            if last:
                self._start_goes_out()
            await self._write_command(chart, run.words[-1] if last else word, run.name)
            reached = await self._wait(chart, {goal, ENABLED})
            if reached.id not in (goal, ENABLED):
                names = {s.id: s.name for s in chart.states}
                raise OrderRefused(
                    f"The drive stays in {reached.name} and does not go to {names[goal]}"
                    f" on 16#{word:04X}."
                )
        if not way:
            self._start_goes_out()
            await self._write_command(chart, run.words[-1], run.name)

    async def _send(self, chart: Chart, order: Order) -> None:
        parameter = order_target(self.session.profile, chart, order)
        for word in with_options(chart, order, self._raws()):
            if parameter.code == chart.command:
                await self._write_command(chart, word, order.name)
            else:
                await self.writer.write(parameter, from_words(parameter, [word]), why=order.name)

    async def _write_command(self, chart: Chart, word: int, why: str) -> None:
        parameter = self.session.profile[chart.command]
        # the state of the drive tells whether it was taken; the word itself is kept on record
        await self.writer.write(parameter, from_words(parameter, [word]), why=why, check=0)
        self.session.note_command()
        self.commander.note_command(parameter.code, word)

    async def _state(self, chart: Chart) -> State:
        await self._read([chart.status])
        return state_of(chart, self._raws()[chart.status])

    async def _wait(self, chart: Chart, goals: Collection[str]) -> State:
        """The state, as soon as it is one of those, or when its time is up."""
        end = time.monotonic() + STEP_TIME
        state = await self._state(chart)
        while state.id not in goals and time.monotonic() < end:
            await asyncio.sleep(STATE_POLL_INTERVAL)
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

    async def refer(self, text: str) -> str:
        readings = await self._read(reference_codes(self.session.profile))
        return await self._give(parse_reference(self.session.profile, text, readings))

    async def step(self, hertz: Decimal) -> str:
        """The reference so many Hz higher or lower."""
        profile = self.session.profile
        readings = await self._read(reference_codes(profile))
        parameter = profile.quantity("command_frequency")
        reading = readings.get(parameter.code) if parameter else None
        if reading is None or reading.value is None or reading.value.number is None:
            raise OrderRefused(f"Where {profile.name} takes its reference is not known.")
        number = within_limits(profile, reading.value.number + hertz, readings)
        return await self._give(parse_reference(profile, f"{number:f}Hz", readings))

    async def _give(self, reference: Reference) -> str:
        await self.writer.write(
            reference.parameter, reference.raw, why="reference", replaceable=True
        )
        self.session.note_command()
        self.commander.note_reference(reference)
        rounded = ", rounded to what the drive can hold" if reference.rounded else ""
        return f"Reference {reference.text} ({reference.parameter.code}){rounded}"

    async def option(self, option: CommandOption, bits: int) -> str:
        parameter = self.session.profile[option.parameter]
        chart = await self._chart()
        reading = (await self._read([parameter.code]))[parameter.code]
        if reading.raw is None:
            raise OrderRefused(f"{parameter.code} cannot be read: {reading.error}")
        running = {state.id for state in chart.states if state.kind in ("running", "stopping")}
        if option.stopped_only and (await self._state(chart)).id in running:
            raise OrderRefused(f"{option.name} is changed with the motor stopped only.")
        word = reading.raw & 0xFFFF & ~option.mask | bits
        await self.writer.write(
            parameter, from_words(parameter, [word]), why=option.name, check=option.mask
        )
        self.session.note_command()
        self.commander.note_option(parameter.code, word)
        name = next(choice.name for choice in option.choices if choice.bits == bits)
        return f"{option.name}: {name}"
