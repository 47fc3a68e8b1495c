"""`drivepanel block`: a drive's indirect blocks or communication scanner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .errors import DONE, DRIVE_REFUSED, USAGE, Failure, told
from .options import (
    Target,
    connect,
    json_option,
    line_argument,
    on_line,
    read_only_option,
    settings_options,
)
from .orders import arm_option, need_arming
from .sets import dry_run_option, write_down

if TYPE_CHECKING:
    from rich.table import Table

    from tui.drive.mapping import Assignment
    from tui.drive.mapping_wire import Stretch
    from tui.session.drive_session import DriveSession
    from tui.session.lines import OpenLine
    from tui.session.mapping import BlockView, Slot

DIFFERENT = 1
"""Exit status of `verify` where a slot does not bring what it stands for."""
ACTIONS = ("show", "verify", "set", "factory", "load", "save")
WRITING = frozenset({"set", "factory", "load"})
HEADINGS = ("Slot", "Stands for", "Name", "Number", "Wire address", "Brings", "Direct", "", "")


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the arguments ask for."""

    action: str
    words: tuple[str, ...]
    dry_run: bool
    as_json: bool


@click.command()
@line_argument
@click.argument("action", type=click.Choice(ACTIONS), default="show")
@click.argument("words", nargs=-1, metavar="[SLOT=CODE... | FILE]")
@dry_run_option
@arm_option
@json_option
@read_only_option
@settings_options
@told
def block(
    target: Target,
    action: str,
    words: tuple[str, ...],
    dry_run: bool,
    arm: bool,
    as_json: bool,
    read_only: bool,
) -> None:
    """Show, compare or change what a drive's indirect blocks or communication scanner bring.

    \b
    show              the slots, what they bring, the same read directly
    verify            the same, compared several times; ends with 1 where a slot differs
    set NMA3=LCR ...  what slots stand for: a code, a number, an address, or none
    factory           every slot as it left the factory
    load FILE         the slots as a file has them
    save FILE         the slots of now into a file, one line each

    Slots are written with the motor at rest, one after another, each read back. Another master
    on the line may rely on today's assignment.
    """
    wanted = Wanted(action, words, dry_run, as_json)
    _check_usage(wanted)
    writes = action in WRITING and not dry_run
    if writes:
        need_arming(arm, "this changes what the drive's blocks stand for")

    async def work(opened: OpenLine) -> int:
        session = await connect(opened, target)
        return await _carry_out(session, target.line_text, wanted)

    status = on_line(target.line_text, work, read_only=read_only or not writes)
    if status != DONE:
        raise click.exceptions.Exit(status)


def _check_usage(wanted: Wanted) -> None:
    needs = {"set": "SLOT=CODE, like NMA3=LCR", "load": "a FILE", "save": "a FILE"}
    if wanted.action in needs and not wanted.words:
        raise click.UsageError(f"{wanted.action} needs {needs[wanted.action]}.")
    if wanted.action in ("load", "save") and len(wanted.words) != 1:
        raise click.UsageError(f"{wanted.action} takes one FILE.")
    if wanted.action not in needs and wanted.words:
        raise click.UsageError(f"{wanted.action} takes nothing behind it.")


async def _carry_out(session: DriveSession, line_text: str, wanted: Wanted) -> int:
    from tui.drive.mapping import MappingError, has_blocks, no_blocks

    if not has_blocks(session.profile):
        if wanted.action != "show":
            raise MappingError(no_blocks(session.profile))
        await _show_neighbours(session, line_text, as_json=wanted.as_json)
        return DONE
    if wanted.action in WRITING:
        return await _write(session, line_text, wanted)
    views = await _looked_at(session, verify=wanted.action == "verify")
    if wanted.action == "save":
        return _save(session, views, Path(wanted.words[0]))
    _show(session, line_text, views, as_json=wanted.as_json)
    return _status(views) if wanted.action == "verify" else DONE


async def _looked_at(session: DriveSession, *, verify: bool) -> list[BlockView]:
    from tui.session.mapping import Mapper

    mapper = Mapper(session)
    look = mapper.verify if verify else mapper.look
    return [await look(block) for block in session.profile.data.blocks]


def _status(views: list[BlockView]) -> int:
    """0 where every slot in use that can be compared brings what it stands for."""
    from tui.session.mapping import Verdict

    wrong = (Verdict.DIFFERS, Verdict.CHANGED, Verdict.NONE)
    for view in views:
        refused = view.block.direction == "read" and view.trouble
        if refused or any(
            slot.verdict in wrong for slot in view.slots if view.block.direction == "read"
        ):
            return DIFFERENT
    return DONE


def _save(session: DriveSession, views: list[BlockView], file: Path) -> int:
    from tui.drive.mapping_file import dumps

    plans = [plan for view in views if (plan := view.plan) is not None]
    if len(plans) != len(views):
        raise Failure("Not every slot could be read; nothing was saved.", DRIVE_REFUSED)
    note = f"{session.profile.name}, device {session.device}, {session.line_text}"
    write_down(file, dumps(session.profile, plans, note))
    click.echo(f"{file}: {sum(len(plan.raws) for plan in plans)} slots of {session.profile.name}")
    return DONE


# Writing


async def _write(session: DriveSession, line_text: str, wanted: Wanted) -> int:
    from tui.bus.errors import DeviceException
    from tui.drive.mapping import changes, describe, problems
    from tui.session.journal import Journal
    from tui.session.mapping_write import AssignmentRefused, write_assignment
    from tui.session.writing import NotTaken

    held, plans = await _plans(session, wanted)
    for plan in plans:
        for problem in problems(session.profile, plan):
            click.echo(problem.text, err=problem.refuses or wanted.as_json)
        if not wanted.dry_run:
            continue
        for change in changes(held, plan):
            was, will = (describe(session.profile, plan.block, r) for r in (change.old, change.new))
            click.echo(f"write  {change.slot}: {was} -> {will}")
    if wanted.dry_run:
        return DONE
    journal = Journal()
    try:
        for plan in plans:
            done = await write_assignment(session, journal, plan, expected=held)
            click.echo(f"{plan.block.name}: {done.text}", err=wanted.as_json)
    except AssignmentRefused as error:
        by_drive = isinstance(error.__cause__, DeviceException | NotTaken)
        if by_drive:
            raise Failure(str(error), DRIVE_REFUSED) from error
        raise
    finally:
        journal.close()
    if wanted.as_json:
        _show(session, line_text, await _looked_at(session, verify=False), as_json=True)
    return DONE


async def _plans(session: DriveSession, wanted: Wanted) -> tuple[dict[str, int], list[Assignment]]:
    """What the slots hold, and the assignments that are wanted in their place."""
    from tui.drive.mapping import MappingError, assignment, factory, pick, place_of
    from tui.session.mapping import Mapper

    profile = session.profile
    named = [_pair(text) for text in wanted.words] if wanted.action == "set" else []
    # told before anything is asked: a slot that is not there
    places = [(*place_of(profile, slot), code) for slot, code in named]
    loaded = _loaded(session, wanted)
    mapper, held = Mapper(session), dict[str, int]()
    plans: list[Assignment] = []
    for block in profile.data.blocks:
        mine = [(place, code) for one, place, code in places if one is block]
        if wanted.action == "set" and not mine:
            continue
        if wanted.action == "load" and block.id not in loaded:
            continue
        found = await mapper.slots(block)
        plan = assignment(block, found)
        if plan is None:
            raise MappingError(f"Not every slot of {block.name.lower()} could be read.")
        held |= plan.slots
        if wanted.action == "factory":
            plan = factory(profile, block)
        plan = loaded.get(block.id, plan)
        for place, code in mine:
            plan = pick(profile, plan, place, code)
        plans.append(plan)
    return held, plans


def _loaded(session: DriveSession, wanted: Wanted) -> dict[str, Assignment]:
    from tui.drive.mapping import MappingError
    from tui.drive.mapping_file import loads

    if wanted.action != "load":
        return {}
    file = wanted.words[0]
    try:
        return loads(Path(file).read_text(encoding="utf-8"), file, session.profile)
    except (OSError, UnicodeDecodeError) as error:
        raise Failure(f"{file} cannot be read: {error}.", USAGE) from error
    except MappingError as error:
        raise Failure(str(error), USAGE) from error


def _pair(text: str) -> tuple[str, str]:
    slot, sign, code = text.partition("=")
    if not sign or not slot.strip():
        raise click.UsageError(f"{text!r} is not written SLOT=CODE, like NMA3=LCR or F875=none.")
    return slot.strip(), code.strip()


# Showing


def _show(session: DriveSession, line_text: str, views: list[BlockView], *, as_json: bool) -> None:
    from .output import console, print_json

    costs = _costs(session, views)
    if as_json:
        print_json(
            {
                **_head(session, line_text),
                "blocks": [view_json(session, view) for view in views],
                "monitoring_us": {"direct": costs[0], "with_blocks": costs[1]},
            }
        )
        return
    out = console()
    for view in views:
        out.print(_table(session, view))
        if view.trouble:
            click.echo(view.trouble)
        if view.block.effective == "after-reset" and view.raws:
            click.echo(_AFTER_RESET)
        if frame_text := _frame(session, view):
            click.echo(f"Request: {frame_text}")
        click.echo("")
    click.echo(
        f"The monitoring set takes {costs[0] / 1000:.1f} ms a cycle on the wire read directly,"
        f" {costs[1] / 1000:.1f} ms with this assignment."
    )


_AFTER_RESET = (
    "What counts since the last reset cannot be read: it is told by comparison with direct reads."
)


def _head(session: DriveSession, line_text: str) -> dict[str, Any]:
    return {"line": line_text, "device": session.device, "profile": session.profile.id}


def _costs(session: DriveSession, views: list[BlockView]) -> tuple[int, int]:
    """Microseconds of a fast cycle of the monitoring set, directly and with these slots."""
    from tui.drive.mapping_wire import saving
    from tui.session.mapping import wire_timing
    from tui.session.monitor import rates_of

    raws = {slot: raw for view in views for slot, raw in view.raws.items()}
    fast = rates_of(session.profile).fast
    found = saving(session.profile, fast, wire_timing(session), {}, raws)
    return found.before.microseconds, found.after.microseconds


def _frame(session: DriveSession, view: BlockView) -> str:
    from tui.drive.frames import hex_text
    from tui.drive.mapping_wire import frame

    inputs = view.plan if view.block.direction == "read" else None
    outputs = view.plan if view.block.direction == "write" else None
    return hex_text(frame(session.profile, session.device, inputs, outputs))


def view_json(session: DriveSession, view: BlockView) -> dict[str, Any]:
    """The object of one block."""
    block = view.block
    return {
        "id": block.id,
        "name": block.name,
        "direction": block.direction,
        "address": block.address,
        "effective": block.effective,
        "trouble": view.trouble or None,
        "request": _frame(session, view) or None,
        "slots": [_slot_json(slot) for slot in view.slots],
    }


def _slot_json(slot: Slot) -> dict[str, Any]:
    from .output import reading_json

    parameter = slot.parameter
    return {
        "slot": slot.code,
        "holds": slot.raw,
        "code": parameter.code if parameter else None,
        "number": parameter.number if parameter else None,
        "address": parameter.address if parameter else None,
        "raw": slot.word,
        "text": slot.text,
        "direct": reading_json(slot.direct) if slot.direct else None,
        "verdict": str(slot.verdict),
        "force": str(slot.force) or None,
        "brings": slot.brings or None,
    }


def _table(session: DriveSession, view: BlockView) -> Table:
    from rich.table import Table
    from rich.text import Text

    title = f"{view.block.name}, 16#{view.block.address:04X}"
    table = Table(
        title=Text(title, style="bold"),
        title_justify="left",
        box=None,
        padding=(0, 2, 0, 0),
        header_style="dim",
    )
    for heading in HEADINGS:
        table.add_column(heading, no_wrap=heading != "Name")
    for slot in view.slots:
        table.add_row(*(Text(cell) for cell in _cells(session, view, slot)))
    return table


def _cells(session: DriveSession, view: BlockView, slot: Slot) -> tuple[str, ...]:
    from tui.drive.mapping import describe

    stands = describe(session.profile, view.block, slot.raw)
    if slot.parameter is None:
        return (slot.code, stands, "", "", "", "", "", str(slot.verdict), "")
    parameter = slot.parameter
    force = str(slot.force) if view.block.effective == "after-reset" else ""
    return (
        slot.code,
        stands,
        parameter.name,
        parameter.number,
        f"{parameter.address} (16#{parameter.address:04X})",
        slot.text,
        slot.direct_text,
        str(slot.verdict),
        f"{force}, brings {slot.brings}" if slot.brings else force,
    )


# Families without blocks


async def _show_neighbours(session: DriveSession, line_text: str, *, as_json: bool) -> None:
    """That there is no block, and which neighbours are worth reading in one request."""
    from tui.drive.mapping import no_blocks
    from tui.drive.mapping_wire import stretches
    from tui.session.mapping import wire_timing
    from tui.session.monitor import monitoring_codes

    from .output import print_json

    status = session.profile.quantity("status_word")
    if status is not None:
        # measured: how long this drive takes to answer
        await session.read([status.code])
    codes = monitoring_codes(session.profile)
    found = stretches(session.profile, codes, wire_timing(session))
    text = no_blocks(session.profile)
    if as_json:
        reads = [stretch_json(stretch) for stretch in found]
        print_json({**_head(session, line_text), "blocks": [], "why": text, "reads": reads})
        return
    click.echo(text)
    for stretch in found:
        request = stretch.request
        click.echo(
            f"{request.count:2d} words from {request.address} (16#{request.address:04X}):"
            f" {', '.join(stretch.brings)}; {stretch.cost / 1000:.1f} ms,"
            f" one by one {stretch.alone / 1000:.1f} ms"
        )


def stretch_json(stretch: Stretch) -> Mapping[str, Any]:
    """The object of one read of neighbours."""
    return {
        "address": stretch.request.address,
        "count": stretch.request.count,
        "codes": list(stretch.brings),
        "beside": list(stretch.beside),
        "us": stretch.cost,
        "one_by_one_us": stretch.alone,
    }
