"""The commands of a person, each as it is carried out under its permit; each says what was done."""

from __future__ import annotations

from decimal import Decimal

from tui.drive.channel import channel_codes
from tui.drive.chart import ENABLED_KINDS, state_of
from tui.drive.command_blocked import held_back, state_refusal
from tui.drive.fault_reset import no_fault, not_in_command
from tui.drive.orders import STOP_ORDERS, OrderRefused, chart_in_force, choose, order_target
from tui.drive.profile.schema import CommandOption, Order, OrderId
from tui.drive.values import from_words

from .access import CommandAccess
from .motor_start import MotorStart, check_scale, without_effect, write_reference
from .reference import (
    Reference,
    parse_reference,
    reference_codes,
    reference_parameters,
    step_in,
    within_limits,
)
from .unblock_hint import block_reason_text

STILL_IN_FAULT = "sent, but the drive is still in fault, as long as its cause is there"


async def give_order(access: CommandAccess, id: OrderId) -> str:
    """Carry out a command that nothing speaks against."""
    chart = await access.chart(id)
    if id in ("forward", "reverse"):
        return await MotorStart(access).carry_out(chart, id)
    state = await access.state(chart)
    if id == "reset" and (nothing := no_fault(chart, state.id, state.kind, state.name)):
        raise OrderRefused(nothing)
    # a fault holds no stop back: its word follows the status word alone
    order = choose(chart, id, access.raws, None if id in STOP_ORDERS else state)
    await access.send(chart, order)
    now = await access.state(chart)
    name = now.name
    if id == "reset" and now.kind == "fault":
        name = not_in_command(access.session.profile, access.raws) or STILL_IN_FAULT
    return f"{order.name}: {name}{await _cleared(access, order)}"


async def _cleared(access: CommandAccess, order: Order) -> str:
    """Return the present reference, if a command resets words to their initial values."""
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
    return f"; the reference is {reading.value.display} now"


async def check_run(access: CommandAccess, id: OrderId, reference: str | None) -> str:
    """Check all that a run depends on, as if the line had taken the control; write nothing."""
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
    if (held := held_back(profile, then, id, raws)) is not None:
        raise OrderRefused(block_reason_text(held))
    if refusal := state_refusal(profile, then, id, raws):
        raise OrderRefused(refusal)
    await check_scale(access)
    if reference is not None:
        await _typed_reference(access, reference)
    return "Nothing speaks against the run."


async def run_at_reference(access: CommandAccess, id: OrderId, reference: str | None) -> str:
    """Reference and run command in one, once nothing speaks against either."""
    chart = await access.chart(id)
    wanted = None if reference is None else await _typed_reference(access, reference)
    done = await MotorStart(access).carry_out(chart, id, wanted)
    return done if reference is None else f"{done}{without_effect(access)}"


async def give_reference(access: CommandAccess, text: str) -> str:
    """Write a reference as typed."""
    wanted = await _typed_reference(access, text)
    return await write_reference(access, wanted, replaceable=True)


async def step_reference(access: CommandAccess, hertz: Decimal) -> str:
    """The reference so many Hz higher or lower; % and V in steps of one, rpm of ten."""
    profile = access.session.profile
    readings = await access.read(reference_codes(profile))
    parameter = next(iter(reference_parameters(profile)), None)
    reading = readings.get(parameter.code) if parameter else None
    value = reading.value if reading is not None else None
    if parameter is None or value is None or value.number is None or value.unit == "raw":
        raise OrderRefused(f"Where {profile.name} takes its reference is not known.")
    number = value.number + hertz * step_in(value.unit)
    number = within_limits(profile, number, readings, parameter)
    wanted = parse_reference(profile, f"{number:f}{value.unit}", readings)
    return await write_reference(access, wanted, replaceable=True)


async def _typed_reference(access: CommandAccess, text: str) -> Reference:
    """A reference as typed, checked against what the drive holds now."""
    profile = access.session.profile
    readings = await access.read([*reference_codes(profile), *channel_codes(profile)])
    return parse_reference(profile, text, readings)


async def set_option(access: CommandAccess, option: CommandOption, bits: int) -> str:
    """Set the bits of an option in its word; the others stay."""
    parameter = access.session.profile[option.parameter]
    chart = await access.chart()
    reading = (await access.read([parameter.code]))[parameter.code]
    if reading.raw is None:
        raise OrderRefused(f"{parameter.code} cannot be read: {reading.error}")
    await access.read([chart.status])
    if option.stopped_only and state_of(chart, access.raws[chart.status]).kind in ENABLED_KINDS:
        raise OrderRefused(f"{option.name} is changed with the motor stopped only.")
    word = reading.raw & 0xFFFF & ~option.mask | bits
    await access.writer.write_parameter(
        parameter, from_words(parameter, [word]), why=option.name, check=option.mask
    )
    access.session.note_command()
    access.given.note_option(parameter.code, word)
    name = next(choice.name for choice in option.choices if choice.bits == bits)
    return f"{option.name}: {name}"
