"""Start of a motor: its reference, the words that lead to running, its direction."""

from __future__ import annotations

from dataclasses import dataclass

from tui.drive.channel import reference_channel
from tui.drive.chart import ENABLED_KINDS, read_chart
from tui.drive.command_blocked import state_refusal
from tui.drive.orders import OrderRefused, choose, walk
from tui.drive.profile.schema import Chart, Order, OrderId, Parameter
from tui.drive.values import hexadecimal

from ..drive import DriveSession
from ..starts.keeper import record_start
from .access import STATE_POLL_INTERVAL, CommandAccess, NotFollowed
from .reference import (
    Reference,
    is_signed,
    other_scale,
    read_back_differs,
    reference_codes,
    reference_parameters,
    scale_codes,
    with_sign,
)

LOOKS = 10
"""Reads within which the motor must turn in the commanded direction."""


NO_EFFECT = "{result}; no effect: the reference comes from {source}"
REFERENCE_TEXTS = {
    (False, False): "Reference {value} ({code})",
    (True, False): "Reference {value} ({code}) for {requested}",
    (False, True): "Reference {value} ({code}), rounded to what the drive can hold",
    (True, True): "Reference {value} ({code}) for {requested}, rounded to what the drive can hold",
}
"""By whether it was converted to another unit, and whether it was rounded."""


class WrongReference(OrderRefused):
    """The drive holds another reference than the requested one; the motor was not started."""


async def write_reference(
    access: CommandAccess, reference: Reference, *, replaceable: bool = False
) -> str:
    """Write a reference; return its result as text."""
    await access.write_parameter(
        reference.parameter, reference.raw, why="reference", replaceable=replaceable
    )
    access.session.note_command()
    text = with_effect(access, reference_text(reference))
    access.given.note_reference(reference, text)
    return text


def reference_text(reference: Reference) -> str:
    """Return a written reference as a text, and how it differs from the requested one."""
    text = REFERENCE_TEXTS[reference.is_converted, bool(reference.rounded)]
    code, requested = reference.parameter.code, reference.requested
    value = f"-{reference.text}" if reference.is_negative else reference.text
    return text.format(value=value, code=code, requested=requested)


async def check_scale(access: CommandAccess) -> None:
    """Raise OrderRefused if another master has changed the scale of references."""
    profile = access.session.profile
    if not (codes := scale_codes(profile)):
        return
    readings = await access.read(codes)
    raws = {code: reading.raw for code, reading in readings.items() if reading.raw is not None}
    if refusal := other_scale(profile, raws):
        raise OrderRefused(refusal)


def with_effect(access: CommandAccess, result: str) -> str:
    """Return the result of giving a reference; it adds if another source gives the reference."""
    found = reference_channel(access.session.profile, access.raws)
    if found is None or found.by_line is not False:
        return result
    return NO_EFFECT.format(result=result, source=found.text)


@dataclass(slots=True)
class MotorStart:
    """One start of one motor."""

    access: CommandAccess
    sent: bool = False
    """True if a run frame was sent, or may have been."""

    @property
    def session(self) -> DriveSession:
        """The drive whose motor is started."""
        return self.access.session

    async def carry_out(self, chart: Chart, id: OrderId, reference: Reference | None = None) -> str:
        """Write the reference, then the words that lead to running; return the result as text.

        Everything that can be checked is checked before the first frame that writes.
        """
        same = [order for order in chart.orders if order.id == id]
        if not same:
            raise OrderRefused(f"The {chart.name} has no command {id!r}.")
        access = self.access
        state = await access.state(chart)
        if refusal := state_refusal(self.session.profile, chart, id, access.raws):
            raise OrderRefused(refusal)
        at_rest = state.kind not in ENABLED_KINDS
        await check_scale(access)
        await record_start(self.session, "reverse" if id == "reverse" else "forward", access.permit)
        try:
            await self._give_reference(reference, reverse=id == "reverse")
            if chart.runs_in is not None:
                await self._walk(chart, same[0], chart.runs_in)
            else:
                order = choose(chart, id, access.raws)
                self.sent = True
                await access.send(chart, order)
            reached = await self._until_running(chart)
        finally:
            self._is_over()
        name = same[0].name
        if at_rest:
            await self._check_direction(chart, id)
        return f"{name}: {reached}"

    async def _check_direction(self, chart: Chart, id: OrderId) -> None:
        """Stop a motor that turns in the wrong direction.

        The bit of the reverse command may be assigned to another function.
        """
        access = self.access
        turns = read_chart(self.session.profile, access.raws).direction
        if turns is None or turns == id:
            return
        for _ in range(LOOKS):
            await self.session.clock.sleep(STATE_POLL_INTERVAL)
            await access.read([chart.direction.parameter] if chart.direction else [])
            turns = read_chart(self.session.profile, access.raws).direction
            if turns == id:
                return
        await access.send(chart, choose(chart, "stop", access.raws))
        raise OrderRefused(
            f"Commanded {id}, the drive turned {turns} and was stopped: its reverse command is"
            " assigned to something else."
        )

    async def _give_reference(self, reference: Reference | None, *, reverse: bool) -> None:
        """Write the reference, read it back as a value, and compare it with the request.

        Without one, the current reference is written: some drives run only after a write of it.
        """
        access, profile = self.access, self.session.profile
        wanted = reference or access.given.wanted
        if wanted is not None:
            wanted = with_sign(profile, wanted, reverse=reverse)
        if reference is not None and wanted is not None:
            await write_reference(access, wanted)
        elif wanted is not None:
            await self._write_again(wanted.parameter, wanted.raw)
        elif (parameter := next(iter(reference_parameters(profile)), None)) is not None:
            raw = (await access.read([parameter.code]))[parameter.code].raw
            if raw is not None:
                if is_signed(profile, parameter.code):
                    raw = -abs(raw) if reverse else abs(raw)
                await self._write_again(parameter, raw)
        if wanted is None or wanted.parameter.access == "w":
            return
        readings = await access.read(reference_codes(profile))
        if differs := read_back_differs(profile, wanted, readings):
            raise WrongReference(f"Not started: {differs}. Give the reference again.")

    async def _write_again(self, parameter: Parameter, raw: int) -> None:
        await self.access.write_parameter(parameter, raw, why="reference before the run order")
        self.session.note_command()

    def _is_over(self) -> None:
        """Let the next standstill end the record of the start, or remove it if nothing was sent.

        Not earlier: a slow drive reports standstill for a while after its run frame.
        """
        starts = self.session.starts
        if starts is not None:
            (starts.sent if self.sent else starts.never_sent)(self.session)

    async def _walk(self, chart: Chart, run: Order, enabled: str) -> None:
        """Write the words that lead to running; wait for each state before the next word."""
        access = self.access
        state = await access.state(chart)
        way = walk(chart, state.id, enabled)
        for goal, word in way:
            last = goal == enabled
            if last:
                self.sent = True
            await access.write_command(chart, run.words[-1] if last else word, run.name)
            reached = await access.wait_for(chart, {goal, enabled})
            if reached.id not in (goal, enabled):
                names = {s.id: s.name for s in chart.states}
                raise NotFollowed(
                    f"The drive stays in {reached.name}: it does not go to {names[goal]}"
                    f" after {hexadecimal(self.session.profile[chart.command], word)}."
                )
        if not way:
            self.sent = True
            await access.write_command(chart, run.words[-1], run.name)

    async def _until_running(self, chart: Chart) -> str:
        running = {s.id for s in chart.states if s.kind == "running"}
        state = await self.access.wait_for(chart, running)
        if state.kind != "running":
            raise NotFollowed(f"The drive does not run: its state is {state.name}.")
        return state.name
