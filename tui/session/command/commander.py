"""Commands of a person to one drive: arming, interlocks, the words of its chart, its reaction.

The methods of `Commander` may be called from any thread and return immediately. The work is done
in the line's loop, and `outcome` is its result. A stop needs none of this: see stop.py.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from decimal import Decimal
from typing import Any

from tui.bus.api import Priority
from tui.drive.channel import channel_codes
from tui.drive.chart import ENABLED_KINDS, state_of
from tui.drive.command_blocked import blocked_reason, state_refusal
from tui.drive.control_source import source_changes, source_codes
from tui.drive.fault_reset import no_fault, not_in_command
from tui.drive.orders import (
    STOP_ORDERS,
    OrderRefused,
    chart_in_force,
    choose,
    deciding_codes,
    order_target,
)
from tui.drive.profile.schema import CommandOption, ControlSource, Order, OrderId
from tui.drive.values import check_raw
from tui.drive.words import raw_of_word, unsigned
from tui.safety import ARMED_FOR, STATE_FRESH

from ..drive import DriveSession
from ..drive_state import drive_state
from ..journal import Journal
from ..monitor.rates import monitoring_codes
from ..read.reader import Reader
from ..settings.write import Writer
from ..starts.keeper import NothingToTakeOver
from ..work import Outcome, OutcomeKind, Permit, Task
from .access import CommandAccess, CommandHistory
from .motor_start import MotorStart, check_scale, with_effect, write_reference
from .reference import (
    Reference,
    is_signed,
    parse_reference,
    reference_codes,
    reference_parameters,
    step_in,
    with_sign,
    within_limits,
)
from .unblock_hint import block_reason_text

CommandWork = Callable[[CommandAccess], Coroutine[Any, Any, str]]
"""A command; it returns what was done."""


class Commander:
    """Gives commands to one drive while it is armed."""

    def __init__(self, session: DriveSession, journal: Journal) -> None:
        self.session = session
        self.journal = journal
        self.last_run: tuple[OrderId, str | None] | None = None
        """The last run command, with the reference that was typed for it."""
        self.given = CommandHistory(session)
        """Commands given by this program that the drive may no longer hold."""
        self._lock = threading.Lock()
        self._steps = Decimal(0)
        self._stepping = False

    @property
    def outcome(self) -> Outcome | None:
        """Result of the last work on the drive."""
        return self.session.work.outcome

    # Arming

    def arm(self, *, seconds: float = ARMED_FOR, stamp: int | None = None) -> None:
        """Arm the drive for a time without a key; read its state first if that is not fresh.

        `stamp` is the drive's stop count when the key was typed: a later stop prevents the
        arming. Raises OrderRefused if the line is read-only or lost, or the drive is barred.
        """
        session = self.session
        requested = session.work.stops if stamp is None else stamp
        refused = session.line.read_only or bool(session.arming.barred)
        if refused or session.state(STATE_FRESH).kind != "unknown":
            session.work.arm(requested, seconds)
            return

        async def work(_permit: Permit) -> str:
            codes = [*deciding_codes(session.profile), *session.profile.data.status_codes]
            await Reader(session).read(dict.fromkeys(codes))
            if session.state(STATE_FRESH).kind == "unknown":
                head = "Not armed" if self.armed_for is None else "Arming not renewed"
                raise OrderRefused(
                    f"{head}: the state of the drive is not known. Check the line, and try again."
                )
            session.work.arm(requested, seconds)
            return ""

        session.work.put(Task(work, owner=self, armed=False))

    @property
    def armed_for(self) -> float | None:
        """Seconds until the drive is disarmed; None if it is not armed."""
        return self.session.arming.armed_for

    # Commands; `stamp` is the drive's stop count when they were typed

    def order(self, id: OrderId, stamp: int | None = None) -> None:
        """Give a command of the drive's chart. Raises OrderRefused if the drive is not armed."""
        self._begin(lambda access: give_order(access, id), stamp)

    def run(self, id: OrderId, reference: str | None = None, stamp: int | None = None) -> None:
        """Run forward or reverse at a typed reference, or at the current one.

        Raises OrderRefused if the drive is not armed.
        """
        self.last_run = (id, reference)
        self._begin(lambda access: run_at_reference(access, id, reference), stamp)

    def check_run(self, id: OrderId, reference: str | None = None) -> None:
        """Check everything that a run depends on, as if the line had control; write nothing.

        Raises OrderRefused if the drive is not armed.
        """
        self._begin(lambda access: check_run(access, id, reference), None)

    def refer(self, text: str, stamp: int | None = None) -> None:
        """Give a reference as typed: 30, 30Hz, 900rpm, 40%. Raises OrderRefused if not armed."""
        self._begin(lambda access: give_reference(access, text), stamp)

    def step(self, hertz: Decimal, stamp: int | None = None) -> None:
        """Change the reference by so many Hz, together with steps that still wait.

        Raises OrderRefused if the drive is not armed.
        """
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
        """Set the bits of an option. Raises OrderRefused if the drive is not armed."""
        self._begin(lambda access: set_option(access, option, bits), stamp)

    def take_over(self, stamp: int | None = None) -> None:
        """Take over a motor that an earlier program has started; send no frame.

        Raises OrderRefused if the drive is not armed.
        """
        session = self.session

        async def work(_access: CommandAccess) -> str:
            if session.starts is None:
                raise NothingToTakeOver("This program keeps no records of motor starts.")
            await asyncio.to_thread(session.starts.take_over, session)
            session.note_command()
            return "Taken over. When you leave, you are asked whether to stop the motor."

        self._begin(work, stamp)

    def configure(self, source: ControlSource, stamp: int | None = None) -> None:
        """Write the settings of a control source. Raises OrderRefused if the drive is not armed."""

        async def work(access: CommandAccess) -> str:
            done = await configure(self.session, access, source)
            self.given.forget_words()
            return done

        self._begin(work, stamp)

    def refuse(self, text: str) -> None:
        """Report why a command was not given."""
        self.session.work.report(OutcomeKind.REFUSED, text)

    def _take_steps(self) -> Decimal:
        """Return the sum of the steps that wait, and forget them."""
        with self._lock:
            steps, self._steps, self._stepping = self._steps, Decimal(0), False
        return steps

    def _begin(self, work: CommandWork, stamp: int | None) -> None:
        """Queue a command behind those before it."""

        async def carry_out(permit: Permit) -> str:
            return await work(CommandAccess(self.session, self.journal, permit, self.given))

        task = Task(carry_out, owner=self, given_up=self._give_up)
        self.session.work.put(task, stamp)
        self.session.arming.touch()

    def _give_up(self) -> None:
        """Forget steps that were not given."""
        self._take_steps()


ORDER_GIVEN = "{order}: {state}"
REFERENCE_LEFT = "{order}: {state}; the reference is {reference} now"
STILL_IN_FAULT = "sent, but the drive is still in fault: its cause is still present"


async def give_order(access: CommandAccess, id: OrderId) -> str:
    """Give a command after its interlocks were checked; return its result as text."""
    chart = await access.chart(id)
    if id in ("forward", "reverse"):
        return await MotorStart(access).carry_out(chart, id)
    state = await access.state(chart)
    if id == "reset" and (nothing := no_fault(chart, state.id, state.kind, state.name)):
        raise OrderRefused(nothing)
    # a fault must not block a stop: its word depends on the status word alone
    order = choose(chart, id, access.raws, None if id in STOP_ORDERS else state)
    await access.send(chart, order)
    now = await access.state(chart)
    name = now.name
    if id == "reset" and now.kind == "fault":
        name = not_in_command(access.session.profile, access.raws) or STILL_IN_FAULT
    reference = await _reference_left(access, order)
    text = REFERENCE_LEFT if reference else ORDER_GIVEN
    return text.format(order=order.name, state=name, reference=reference)


async def _reference_left(access: CommandAccess, order: Order) -> str:
    """Return the current reference if a command resets words; empty for other commands."""
    if not order.clears:
        return ""
    access.session.image.forget(order.clears)
    readings = await access.read(order.clears)
    wanted = access.given.wanted
    now = readings.get(wanted.parameter.code) if wanted is not None else None
    if wanted is not None and now is not None and now.raw != wanted.raw:
        access.given.forget_reference()
    parameter = access.session.profile.quantity("command_frequency")
    reading = readings.get(parameter.code) if parameter is not None else None
    if reading is None or reading.value is None:
        return ""
    return reading.value.display


async def check_run(access: CommandAccess, id: OrderId, reference: str | None) -> str:
    """Check everything that a run depends on, as if the line had control; write nothing."""
    profile, chart = access.session.profile, await access.chart()
    await access.state(chart)
    taken = {
        order_target(profile, chart, order).code: order.words[-1]
        for order in chart.orders
        if order.id == "take-control"
    }
    raws = {**access.raws, **taken}
    if (then := chart_in_force(profile, raws)) is None:
        then = chart
    if (held := blocked_reason(profile, then, id, raws)) is not None:
        raise OrderRefused(block_reason_text(held))
    if refusal := state_refusal(profile, then, id, raws):
        raise OrderRefused(refusal)
    await check_scale(access)
    if reference is not None:
        await _typed_reference(access, reference)
    return "Nothing prevents the run."


async def run_at_reference(access: CommandAccess, id: OrderId, reference: str | None) -> str:
    """Give a reference and a run command after both were checked."""
    chart = await access.chart(id)
    wanted = None if reference is None else await _typed_reference(access, reference)
    done = await MotorStart(access).carry_out(chart, id, wanted)
    return done if reference is None else with_effect(access, done)


async def give_reference(access: CommandAccess, text: str) -> str:
    """Write a typed reference; return its result as text."""
    wanted = await _typed_reference(access, text)
    return await write_reference(access, _kept_direction(access, wanted), replaceable=True)


def _kept_direction(access: CommandAccess, wanted: Reference) -> Reference:
    """Return a typed reference with the sign of the present one, which is the direction.

    Raises OrderRefused if the present one is not known.
    """
    profile, code = access.session.profile, wanted.parameter.code
    if not is_signed(profile, code):
        return wanted
    held, last = access.raws.get(code), access.given.wanted
    if held is None:
        raise OrderRefused(
            f"Not written: {code} was not read, and its sign is the direction of rotation."
        )
    # at 0 the last reference still shows the direction of the run command
    reverse = held < 0 or (held == 0 and last is not None and last.is_negative)
    return with_sign(profile, wanted, reverse=reverse)


async def step_reference(access: CommandAccess, hertz: Decimal) -> str:
    """Change the reference by so many Hz; 1 Hz is 1 % or 1 V, and 10 rpm, in other units."""
    profile = access.session.profile
    readings = await access.read(reference_codes(profile))
    parameter = next(iter(reference_parameters(profile)), None)
    reading = readings.get(parameter.code) if parameter else None
    value = reading.value if reading is not None else None
    if parameter is None or value is None or value.number is None or value.unit == "raw":
        raise OrderRefused(f"It is not known where {profile.name} takes its reference.")
    signed = is_signed(profile, parameter.code)
    # the sign of such a word is the direction, and a step changes the speed
    now = abs(value.number) if signed else value.number
    number = now + hertz * step_in(value.unit)
    number = within_limits(profile, number, readings, parameter)
    wanted = parse_reference(profile, f"{number:f}{value.unit}", readings)
    return await write_reference(access, _kept_direction(access, wanted), replaceable=True)


async def _typed_reference(access: CommandAccess, text: str) -> Reference:
    """Read what a typed reference depends on, and convert it. Raises as `parse_reference`."""
    profile = access.session.profile
    readings = await access.read([*reference_codes(profile), *channel_codes(profile)])
    return parse_reference(profile, text, readings)


async def set_option(access: CommandAccess, option: CommandOption, bits: int) -> str:
    """Set the bits of an option in its word, and keep the others; return the result as text."""
    parameter = access.session.profile[option.parameter]
    chart = await access.chart()
    reading = (await access.read([parameter.code]))[parameter.code]
    if reading.raw is None:
        raise OrderRefused(f"{parameter.code} cannot be read: {reading.error}")
    await access.read([*chart.status_codes])
    if option.stopped_only and state_of(chart, access.raws).kind in ENABLED_KINDS:
        raise OrderRefused(f"Not set: {option.name} is changed with the motor stopped only.")
    word = unsigned(reading.raw) & ~option.mask | bits
    await access.write_parameter(
        parameter, raw_of_word(parameter, word), why=option.name, check=option.mask
    )
    access.session.note_command()
    access.given.note_option(parameter.code, word)
    name = next(choice.name for choice in option.choices if choice.bits == bits)
    return f"{option.name}: {name}"


async def configure(session: DriveSession, writer: Writer, source: ControlSource) -> str:
    """Write the settings that differ from a control source; return the result as text.

    All are read again before each write, because one setting may change later ones, as the
    access level does. Raises OrderRefused unless the motor is known to be at rest, the line's
    errors, ValueRefused and NotTaken.
    """
    profile = session.profile
    written: list[str] = []
    for setting in source.settings:
        parameter = profile[setting.parameter]
        await _at_rest(session)
        raws = await _raws(session)
        todo = {change.parameter.code for change in source_changes(profile, source, raws)}
        if parameter.code not in todo:
            continue
        scale = profile.scale(parameter, raws)
        check_raw(parameter, setting.value, profile.names(parameter), scale)
        await writer.write_parameter(parameter, setting.value, why=f"control source: {source.name}")
        written.append(parameter.code)
    left = source_changes(profile, source, await _raws(session))
    if left:
        codes = ", ".join(change.parameter.code for change in left)
        raise OrderRefused(f"{source.name}: the drive has changed {codes} again.")
    if not written:
        return f"Control source {source.name}: no change was necessary"
    return f"Control source {source.name}: wrote {', '.join(written)}"


async def _raws(session: DriveSession) -> dict[str, int]:
    codes = source_codes(session.profile)
    readings = await Reader(session).read(codes, priority=Priority.OPERATOR_READ)
    unread = [code for code, reading in readings.items() if reading.raw is None]
    if unread:
        raise OrderRefused(f"{', '.join(unread)} cannot be read, so nothing was changed.")
    return {code: reading.raw for code, reading in readings.items() if reading.raw is not None}


async def _at_rest(session: DriveSession) -> None:
    readings = await Reader(session).read(
        monitoring_codes(session.profile), priority=Priority.OPERATOR_READ
    )
    state = drive_state(session.profile, readings)
    if state.motion in ("running", "stopping", "starting", "unknown"):
        raise OrderRefused(
            "Not written: the control source is changed with the motor stopped only."
            f" Now: {state.headline}."
        )
