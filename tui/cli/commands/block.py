"""`drivepanel block`: a drive's indirect blocks or communication scanner."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.bus.errors import LineError

from ..shared.block_output import show_blocks, show_neighbors
from ..shared.drive_commands import (
    arm_option,
    close_journal,
    complain,
    journal_document,
    need_arming,
    permit_of,
)
from ..shared.errors import (
    DIFFERENT,
    DONE,
    DRIVE_REFUSED,
    REFUSED_HERE,
    USAGE,
    Failure,
    end_with,
    status_of,
)
from ..shared.options import (
    Target,
    connect_drive,
    json_option,
    line_argument,
    never_forced,
    on_line,
    read_only_option,
    settings_options,
)
from ..shared.registration import WRITING, command
from ..shared.say import say
from ..shared.sets import dry_run_option, refuse_output, write_down
from ..shared.standard_streams import STANDARD, given_file

if TYPE_CHECKING:
    from tui.drive.blocks.assignment import Assignment
    from tui.session.blocks.mapping import BlockView
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.setting_documents import SlotChangeField

BLOCK_COMMANDS = ("show", "verify", "set", "factory", "load", "save")
WRITING_ACTIONS = frozenset({"set", "factory", "load"})


@command(
    "Show or change a drive's indirect block or scanner.",
    group="Set up",
    statuses=(DIFFERENT, *WRITING),
    acts=True,
)
@line_argument
@click.argument("action", type=click.Choice(BLOCK_COMMANDS), default="show")
@click.argument("words", nargs=-1, metavar="[SLOT=CODE... | FILE]")
@dry_run_option
@arm_option
@json_option
@read_only_option
@never_forced
@settings_options
def block(
    target: Target,
    action: str,
    words: tuple[str, ...],
    dry_run: bool,
    arm: bool,
    as_json: bool,
    read_only: bool,
) -> None:
    """Show, compare or change the mapping of a drive's indirect blocks or communication scanner.

    \b
    show              the slots, the values that they return, and direct reads
    verify            the same, compared several times; ends with 1 if a slot differs
    set NMA3=LCR ...  map slots to a code, a number, an address, or none
    factory           map every slot as in the factory setting
    load FILE         map the slots as in a file; - is standard input
    save FILE         save the present slots to a file, one line each; - is standard output

    Slots are written at standstill, one after another, each read back. Another master on the line
    may rely on the present assignment.
    """
    wanted = Wanted(action, words, dry_run, as_json)
    _check_usage(wanted)
    writes = action in WRITING_ACTIONS and not dry_run
    if writes:
        need_arming(arm, "this changes what the drive's slots are mapped to")

    async def work(opened: OpenLine) -> int:
        session = await connect_drive(opened, target)
        return await _carry_out(session, target.line_text, wanted)

    end_with(on_line(target, work, read_only=read_only or not writes))


def _check_usage(wanted: Wanted) -> None:
    needs = {"set": "SLOT=CODE, like NMA3=LCR", "load": "a FILE", "save": "a FILE"}
    if wanted.action in needs and not wanted.words:
        raise click.UsageError(f"{wanted.action} needs {needs[wanted.action]}.")
    if wanted.action in ("load", "save") and len(wanted.words) != 1:
        raise click.UsageError(f"{wanted.action} takes one FILE.")
    if wanted.action not in needs and wanted.words:
        raise click.UsageError(f"{wanted.action} takes no further words.")


async def _carry_out(session: DriveSession, line_text: str, wanted: Wanted) -> int:
    from tui.drive.blocks.assignment import has_blocks, no_blocks

    if not has_blocks(session.profile):
        if wanted.action != "show":
            raise Failure(no_blocks(session.profile), REFUSED_HERE)
        await _measure_answer(session)
        show_neighbors(session, line_text, as_json=wanted.as_json)
        return DONE
    if wanted.action in WRITING_ACTIONS:
        return await _write(session, line_text, wanted)
    views = await _looked_at(session, verify=wanted.action == "verify")
    if wanted.action == "save":
        return _save(session, line_text, views, wanted)
    show_blocks(session, line_text, views, as_json=wanted.as_json)
    return _status(views) if wanted.action == "verify" else DONE


async def _measure_answer(session: DriveSession) -> None:
    """One read, after which it is known how long this drive takes to answer."""
    from tui.session.read.reader import Reader

    status = session.profile.quantity("status_word")
    if status is not None:
        await Reader(session).read([status.code])


async def _looked_at(session: DriveSession, *, verify: bool) -> list[BlockView]:
    from tui.session.blocks.mapping import Mapper

    mapper = Mapper(session)
    look = mapper.verify if verify else mapper.look
    return [await look(block) for block in session.profile.data.blocks]


def _status(views: list[BlockView]) -> int:
    """0 if every comparable slot in use returns its mapped parameter."""
    from tui.session.read.proof import SlotMatch

    wrong = (SlotMatch.DIFFERS, SlotMatch.CHANGED, SlotMatch.NONE)
    for view in views:
        refused = view.block.direction == "read" and view.trouble
        if refused or any(
            slot.verdict in wrong for slot in view.slots if view.block.direction == "read"
        ):
            return DIFFERENT
    return DONE


def _save(session: DriveSession, line_text: str, views: list[BlockView], wanted: Wanted) -> int:
    from tui.drive.blocks.file import dump_blocks

    from ..documents.setting_documents import BlockFileDocument
    from ..shared.output import drive_fields, print_json

    file = Path(wanted.words[0])
    refuse_output(file, force=False, as_json=wanted.as_json)
    plans = [plan for view in views if (plan := view.plan) is not None]
    if len(plans) != len(views):
        raise Failure("Not every slot could be read; nothing was saved.", DRIVE_REFUSED)
    note = f"{session.profile.name}, device {session.device}, {line_text}"
    write_down(file, dump_blocks(session.profile, plans, note))
    count = sum(len(plan.raws) for plan in plans)
    if wanted.as_json:
        fields = drive_fields(line_text, session)
        print_json(BlockFileDocument(**fields, file=str(file), slots=count))
    elif file != STANDARD:
        say(f"{file}: {count} slots of {session.profile.name}")
    return DONE


# Writing


async def _write(session: DriveSession, line_text: str, wanted: Wanted) -> int:
    from tui.session.blocks.write import AssignmentRefused, write_assignment
    from tui.session.settings.write import NotTaken

    from ..documents.setting_documents import BlockChangeDocument
    from ..shared.output import drive_fields, print_json

    held, plans = await plans_of(session, wanted)
    changes = _judged(session, held, plans, wanted)
    if wanted.dry_run:
        if wanted.as_json:
            print_json(BlockChangeDocument(**drive_fields(line_text, session), changes=changes))
        return DONE
    journal, sent, permit = journal_document(), dict[str, bool](), permit_of(session)
    try:
        for plan in plans:
            done = await write_assignment(
                session, journal, plan, permit=permit, expected=held,
                sent=lambda change, taken: sent.update({change.slot: taken}),
            )  # fmt: skip
            say(f"{plan.block.name}: {done.text}", err=wanted.as_json)
    except asyncio.CancelledError:
        if sent:
            complain(_cut_short(sent))
        raise
    except AssignmentRefused as error:
        cause = error.__cause__
        status = status_of(cause) if isinstance(cause, LineError | NotTaken) else None
        raise Failure(str(error), status or REFUSED_HERE) from error
    finally:
        close_journal(journal)
    if wanted.as_json:
        show_blocks(session, line_text, await _looked_at(session, verify=False), as_json=True)
    return DONE


def _cut_short(sent: dict[str, bool]) -> str:
    """Report what Ctrl-C or a signal left; by slot, whether the drive was seen to hold it."""
    held = ", ".join(slot for slot, taken in sent.items() if taken) or "none"
    open_yet = ", ".join(slot for slot, taken in sent.items() if not taken)
    text = f"Slots written and verified: {held}."
    return f"{text} {open_yet} may have been written too: look at it." if open_yet else text


def _judged(
    session: DriveSession, held: dict[str, int], plans: list[Assignment], wanted: Wanted
) -> list[SlotChangeField]:
    """Return the changes of a dry run; raises Failure if a change is refused."""
    from tui.drive.blocks.assignment import describe, slot_changes
    from tui.drive.blocks.slot_rules import assignment_problems, refusing

    from ..documents.setting_documents import SlotChangeField

    refused: list[str] = []
    changes: list[SlotChangeField] = []
    for plan in plans:
        found = assignment_problems(session.profile, plan)
        refused += [problem.text for problem in refusing(found)]
        for problem in found:
            if not problem.refuses:
                say(problem.text, err=wanted.as_json)
        for change in slot_changes(held, plan):
            was, will = (describe(session.profile, plan.block, r) for r in (change.old, change.new))
            changes.append(SlotChangeField(slot=change.slot, old=was, new=will))
            if wanted.dry_run and not wanted.as_json:
                say(f"write  {change.slot}: {was} -> {will}")
    if refused:
        raise Failure(" ".join(refused), USAGE)
    return changes


@dataclass(frozen=True, slots=True)
class Wanted:
    """Slots requested by the arguments."""

    action: str
    words: tuple[str, ...]
    dry_run: bool
    as_json: bool


async def plans_of(
    session: DriveSession, wanted: Wanted
) -> tuple[dict[str, int], list[Assignment]]:
    """Return the slots' contents, and the assignments requested for them."""
    from tui.drive.blocks.assignment import assignment, factory, place_of
    from tui.drive.blocks.picking import pick
    from tui.session.blocks.mapping import Mapper

    profile = session.profile
    named = [_pair(text) for text in wanted.words] if wanted.action == "set" else []
    _check_once([slot for slot, _ in named])
    # before any request: report a slot that does not exist
    places = [(*place_of(profile, slot), code) for slot, code in named]
    loaded = _loaded(session, wanted)
    mapper, held = Mapper(session), dict[str, int]()
    plans: list[Assignment] = []
    for block in profile.data.blocks:
        mine = [(place, code) for item, place, code in places if item is block]
        if wanted.action == "set" and not mine:
            continue
        if wanted.action == "load" and block.id not in loaded:
            continue
        found = await mapper.slots(block)
        plan = assignment(block, found)
        if plan is None:
            raise Failure(f"Not every slot of {block.name} could be read.", REFUSED_HERE)
        held |= plan.slots
        if wanted.action == "factory":
            plan = factory(profile, block)
        plan = loaded.get(block.id, plan)
        for place, code in mine:
            plan = pick(profile, plan, place, code)
        plans.append(plan)
    return held, plans


def _loaded(session: DriveSession, wanted: Wanted) -> dict[str, Assignment]:
    from tui.drive.blocks.assignment import MappingError
    from tui.drive.blocks.file import load_blocks
    from tui.drive.small_file import read_small_text

    if wanted.action != "load":
        return {}
    file = wanted.words[0]
    try:
        return load_blocks(read_small_text(given_file(Path(file))), file, session.profile)
    except OSError as error:
        raise Failure(f"{file} cannot be read: {error.strerror}.", USAGE) from error
    except UnicodeDecodeError as error:
        raise Failure(f"{file}: byte {error.start} is not UTF-8 text.", USAGE) from error
    except MappingError as error:
        raise Failure(str(error), USAGE) from error


def _check_once(slots: list[str]) -> None:
    folded = [slot.casefold() for slot in slots]
    if twice := ", ".join(slot for slot in slots if folded.count(slot.casefold()) > 1):
        raise click.UsageError(f"{twice}: given more than once. Which code is meant?")


def _pair(text: str) -> tuple[str, str]:
    slot, sign, code = text.partition("=")
    if not sign or not slot.strip():
        raise click.UsageError(f"{text!r} is not written SLOT=CODE or SLOT=none.")
    return slot.strip(), code.strip()
