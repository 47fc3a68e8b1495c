"""The commands of a person, each as it is carried out under its permit; each says what was done."""

from __future__ import annotations

from decimal import Decimal

from tui.drive.channel import channel_codes, reference_channel
from tui.drive.chart import ENABLED_KINDS, state_of
from tui.drive.orders import STOP_ORDERS, OrderRefused, choose
from tui.drive.profile.schema import CommandOption, Order, OrderId
from tui.drive.values import from_words

from .access import CommandAccess
from .motor_start import MotorStart
from .reference import Reference, parse_reference, reference_codes, within_limits

STILL_IN_FAULT = "sent, but the drive is still in fault, as long as its cause is there"


async def give_order(access: CommandAccess, id: OrderId) -> str:
    """Carry out a command that nothing speaks against."""
    chart = await access.chart(id)
    if id in ("forward", "reverse"):
        return await MotorStart(access).carry_out(chart, id)
    state = await access.state(chart)
    # a fault holds no stop back: its word follows the status word alone
    order = choose(chart, id, access.raws, None if id in STOP_ORDERS else state)
    await access.send(chart, order)
    now = await access.state(chart)
    name = STILL_IN_FAULT if id == "reset" and now.kind == "fault" else now.name
    return f"{order.name}: {name}{await _cleared(access, order)}"


async def _cleared(access: CommandAccess, order: Order) -> str:
    """What the reference is now, where an order puts words back to their initial values."""
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


async def run_at_reference(access: CommandAccess, id: OrderId, reference: str | None) -> str:
    """Reference and run command in one, once nothing speaks against the command."""
    chart = await access.chart(id)
    if reference is not None:
        await give_reference(access, reference)
    done = await MotorStart(access).carry_out(chart, id)
    return done if reference is None else f"{done}{_without_effect(access)}"


async def give_reference(access: CommandAccess, text: str) -> str:
    """Write a reference as typed."""
    profile = access.session.profile
    readings = await access.read([*reference_codes(profile), *channel_codes(profile)])
    return await _write_reference(access, parse_reference(profile, text, readings))


async def step_reference(access: CommandAccess, hertz: Decimal) -> str:
    """The reference so many Hz higher or lower."""
    profile = access.session.profile
    readings = await access.read(reference_codes(profile))
    parameter = profile.quantity("command_frequency")
    reading = readings.get(parameter.code) if parameter else None
    if reading is None or reading.value is None or reading.value.number is None:
        raise OrderRefused(f"Where {profile.name} takes its reference is not known.")
    number = within_limits(profile, reading.value.number + hertz, readings)
    return await _write_reference(access, parse_reference(profile, f"{number:f}Hz", readings))


async def _write_reference(access: CommandAccess, reference: Reference) -> str:
    await access.writer.write_parameter(
        reference.parameter, reference.raw, why="reference", replaceable=True
    )
    access.session.note_command()
    access.given.note_reference(reference)
    rounded = ", rounded to what the drive can hold" if reference.rounded else ""
    without = _without_effect(access)
    return f"Reference {reference.text} ({reference.parameter.code}){rounded}{without}"


def _without_effect(access: CommandAccess) -> str:
    """That a reference given from here changes nothing, where somebody else surely gives it."""
    found = reference_channel(access.session.profile, access.raws)
    if found is None or found.by_line is not False:
        return ""
    return f"; no effect from here: the reference comes from {found.text}"


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
