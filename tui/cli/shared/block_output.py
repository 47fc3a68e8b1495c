"""Output of `drivepanel block`: tables for a person, or one JSON document."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .rows import Column, table_of
from .say import say

if TYPE_CHECKING:
    from rich.table import Table

    from tui.drive.blocks.wire_cost import Stretch
    from tui.session.blocks.mapping import BlockView, Slot
    from tui.session.drive import DriveSession

    from ..documents.setting_documents import BlockField, NeighborReadField, SlotField

BLOCK_COLUMNS = (
    Column("Slot", readable=100),
    Column("Mapped to"),
    Column("Name", omitted=3),
    Column("Number", omitted=2),
    Column("Wire address", omitted=1),
    Column("Brings"),
    Column("Direct"),
    Column(),
    Column(),
)
"""Columns of a table of slots."""
AFTER_RESET = (
    "The mapping in force since the last reset cannot be read."
    " Comparison with direct reads shows it."
)


def show_blocks(
    session: DriveSession, line_text: str, views: list[BlockView], *, as_json: bool
) -> None:
    """Print the blocks of a drive, their values, and the time that they save on the line."""
    from ..documents.setting_documents import BlocksDocument, MonitoringTimeField
    from .output import console, drive_fields, print_json

    costs = _costs(session, views)
    if as_json:
        print_json(
            BlocksDocument(
                **drive_fields(line_text, session),
                blocks=[block_field(session, view) for view in views],
                monitoring_us=MonitoringTimeField(direct=costs[0], with_blocks=costs[1]),
            )
        )
        return
    out = console()
    for view in views:
        out.print(_table(session, view, out.width))
        if view.trouble:
            say(view.trouble)
        if view.block.effective == "after-reset" and view.raws:
            say(AFTER_RESET)
        if frame_text := _frame(session, view):
            say(f"Request: {frame_text}")
        say()
    say(
        f"The monitoring set takes {costs[0] / 1000:.1f} ms a cycle on the wire read directly,"
        f" {costs[1] / 1000:.1f} ms with this assignment."
    )


def _costs(session: DriveSession, views: list[BlockView]) -> tuple[int, int]:
    """Microseconds of a fast cycle of the monitoring set, directly and with these slots."""
    from tui.drive.blocks.wire_cost import saving
    from tui.session.blocks.mapping import wire_timing
    from tui.session.monitor.rates import rates_of

    raws = {slot: raw for view in views for slot, raw in view.raws.items()}
    fast = rates_of(session.profile).fast
    found = saving(session.profile, fast, wire_timing(session), {}, raws)
    return found.before.microseconds, found.after.microseconds


def _frame(session: DriveSession, view: BlockView) -> str:
    from tui.drive.blocks.wire_cost import block_request
    from tui.wire.frames import hex_text

    inputs = view.plan if view.block.direction == "read" else None
    outputs = view.plan if view.block.direction == "write" else None
    return hex_text(block_request(session.profile, session.device, inputs, outputs))


def block_field(session: DriveSession, view: BlockView) -> BlockField:
    """One block with its slots."""
    from ..documents.setting_documents import BlockField

    block = view.block
    return BlockField(
        id=block.id,
        name=block.name,
        direction=block.direction,
        address=block.address,
        effective=block.effective,
        trouble=view.trouble or None,
        request=_frame(session, view) or None,
        slots=[_slot_field(slot) for slot in view.slots],
    )


def _slot_field(slot: Slot) -> SlotField:
    from ..documents.setting_documents import SlotField
    from .output import value_field

    parameter = slot.parameter
    return SlotField(
        slot=slot.code,
        holds=slot.raw,
        code=parameter.code if parameter else None,
        number=parameter.number if parameter else None,
        address=parameter.address if parameter else None,
        raw=slot.word,
        text=slot.text,
        direct=value_field(slot.direct) if slot.direct else None,
        verdict=str(slot.verdict),
        force=str(slot.force) or None,
        brings=slot.returned_code or None,
    )


def _table(session: DriveSession, view: BlockView, width: int) -> Table:
    """Return the slots of a block; those that bring nothing in one row."""
    rows = [_cells(session, view, slot) for slot in _in_use(view)]
    if unused := _unused(view):
        rows.append((unused, "unused", *[""] * (len(BLOCK_COLUMNS) - 2)))
    title = f"{view.block.name}, 16#{view.block.address:04X}"
    return table_of(BLOCK_COLUMNS, rows, title, width=width)


def _in_use(view: BlockView) -> list[Slot]:
    from tui.session.read.proof import SlotMatch

    return [slot for slot in view.slots if slot.verdict is not SlotMatch.UNUSED]


def _unused(view: BlockView) -> str:
    """The slots that bring nothing: `NMA3 to NMA8`."""
    used = {slot.code for slot in _in_use(view)}
    codes = [slot.code for slot in view.slots if slot.code not in used]
    places = [at for at, slot in enumerate(view.slots) if slot.code not in used]
    together = places == list(range(places[0], places[-1] + 1)) if places else False
    if len(codes) > 2 and together:
        return f"{codes[0]} to {codes[-1]}"
    return ", ".join(codes)


def _cells(session: DriveSession, view: BlockView, slot: Slot) -> tuple[str, ...]:
    from tui.drive.blocks.assignment import describe

    mapped = describe(session.profile, view.block, slot.raw)
    if slot.parameter is None:
        return (slot.code, mapped, "", "", "", "", "", str(slot.verdict), "")
    parameter = slot.parameter
    force = str(slot.force) if view.block.effective == "after-reset" else ""
    return (
        slot.code,
        mapped,
        parameter.name,
        parameter.number,
        f"{parameter.address} (16#{parameter.address:04X})",
        slot.text,
        slot.direct_text,
        str(slot.verdict),
        f"{force}, returns {slot.returned_code}" if slot.returned_code else force,
    )


# Families without blocks


def show_neighbors(session: DriveSession, line_text: str, *, as_json: bool) -> None:
    """Report that the family has no block, and which neighbors to read in one request."""
    from tui.drive.blocks.assignment import no_blocks
    from tui.drive.blocks.wire_cost import stretches
    from tui.session.blocks.mapping import wire_timing
    from tui.session.monitor.rates import monitoring_codes

    from ..documents.setting_documents import BlocksDocument
    from .output import drive_fields, print_json

    codes = monitoring_codes(session.profile)
    found = stretches(session.profile, codes, wire_timing(session))
    text = no_blocks(session.profile)
    if as_json:
        fields = drive_fields(line_text, session)
        reads = [_neighbor_field(stretch) for stretch in found]
        print_json(BlocksDocument(**fields, blocks=[], why=text, reads=reads))
        return
    say(text)
    for stretch in found:
        request = stretch.request
        say(
            f"{request.count:2d} words from {request.address} (16#{request.address:04X}):"
            f" {', '.join(stretch.codes)}; {stretch.cost / 1000:.1f} ms,"
            f" one by one {stretch.alone / 1000:.1f} ms"
        )


def _neighbor_field(stretch: Stretch) -> NeighborReadField:
    from ..documents.setting_documents import NeighborReadField

    return NeighborReadField(
        address=stretch.request.address,
        count=stretch.request.count,
        codes=list(stretch.codes),
        beside=list(stretch.beside),
        us=stretch.cost,
        one_by_one_us=stretch.alone,
    )
