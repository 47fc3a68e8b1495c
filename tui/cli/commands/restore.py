"""`drivepanel restore`: a parameter set back into a drive."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

import click

from tui.bus.errors import RequestRefused
from tui.drive.sentences import first_of, sentence

from ..shared.asking import wear_gate
from ..shared.drive_commands import (
    arm_option,
    close_journal,
    journal_document,
    need_arming,
    permit_of,
)
from ..shared.drives import on_each_drive
from ..shared.errors import DONE, DRIVE_REFUSED, LINE_TROUBLE
from ..shared.options import (
    Target,
    connect_drive,
    devices_option,
    json_option,
    line_argument,
    never_forced,
    profile_option,
    read_only_option,
)
from ..shared.output import drive_fields
from ..shared.registration import WRITING, command
from ..shared.say import Messages
from ..shared.sets import (
    ResultTelling,
    codes_of,
    confirm_option,
    counter,
    dry_run_option,
    file_argument,
    need_way_to_save,
    result_fields,
    round_option,
    save_option,
    say_afterwards,
    set_in,
    status_of_results,
)

if TYPE_CHECKING:
    from tui.drive.settings.edits import Edit
    from tui.drive.settings.parameter_set import ParameterSet
    from tui.drive.settings.recipes import DriveRecipe
    from tui.drive.settings.restore_plan import Options, RestoreItem, RestorePlan
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.settings.applied import Result
    from tui.session.settings.restore import Restored

    from ..documents.parts import EditField, PlanItemField
    from ..documents.setting_documents import RestoreDocument


class _Restored(TypedDict):
    """The fields of the document about the plan and its results."""

    plan: list[PlanItemField]
    same_rating: bool | None
    needs_stop: bool
    across: bool
    mapped_by: str | None
    results: list[EditField]
    saved: bool
    left: list[str]


ACROSS_QUANTITIES = (
    "The set is of another family: common quantities are carried over in their units."
)
ACROSS_TABLE = "The set is of a predecessor: settings that mean the same are carried over."
NEWEST = "newest"
"""FILE that stands for the newest backup of the drive at this address."""
ALIKE = 3
"""If more settings than this are omitted for one reason, they are reported without their values."""
CODES_NAMED = 12
"""Number of codes named for one reason; --dry-run names all."""


@command("Restore a parameter set to a drive.", group="Set up", statuses=WRITING, acts=True)
@line_argument
@file_argument
@dry_run_option
@arm_option
@click.option("--line-settings", is_flag=True, help="Write address, baud rate and format too.")
@click.option("--rating", is_flag=True, help="Write rating and motor data to another model too.")
@confirm_option
@round_option
@save_option
@read_only_option
@json_option
@never_forced
@profile_option
@devices_option("Use the drive at this address; repeatable (default: 1, or all of a recipe file).")
def restore(
    line_text: str,
    file: Path,
    dry_run: bool,
    arm: bool,
    line_settings: bool,
    rating: bool,
    confirmed: tuple[str, ...],
    rounded: bool,
    save: bool,
    read_only: bool,
    as_json: bool,
    profile_id: str | None,
    devices: tuple[int, ...],
) -> None:
    """Restore a parameter set to a drive: differences are written and read back.

    If FILE is a file of recipes, each of its drives gets the set of its own recipe.

    With several -d, the set is restored to each drive in turn. If it fails on one drive, it is
    still restored to the others.

    If FILE is `newest`, --dry-run shows the newest backup of the drive or of its predecessor at
    this address, and how rating and firmware compare. It then names the next commands.

    --dry-run shows what would be written, what is omitted, and why. To resume an interrupted
    restore, repeat the command: it reads the drive, and writes what is missing.
    """
    from tui.drive.settings.recipes import is_recipe_file
    from tui.drive.settings.restore_plan import Options

    from ..documents.setting_documents import RestoreDocument
    from ..running.recipe_comparison import recipes_in

    _either(dry_run=dry_run, arm=arm)
    newest = str(file) == NEWEST and not file.exists()
    if newest and not dry_run:
        text = f"{NEWEST} needs --dry-run: look at the differences first. It names the file."
        raise click.UsageError(text)
    recipes: dict[int, DriveRecipe] = {}
    if is_recipe_file(file):
        if profile_id is not None:
            raise click.UsageError("The profiles are in the file of recipes: omit -p.")
        recipes = {recipe.device: recipe for recipe in recipes_in(file, devices)}
    elif not devices:
        devices = (1,)
    chosen = None if newest or recipes else set_in(file)
    telling = ResultTelling(Messages(as_json=as_json))

    async def restore_drive(opened: OpenLine, target: Target) -> tuple[RestoreDocument, int]:
        nonlocal telling
        telling = ResultTelling(Messages(as_json=as_json))
        recipe = recipes.get(target.device)
        if recipe is not None:
            target = target._replace(profile_id=recipe.profile.id, by_recipe=True)
        session = await connect_drive(opened, target)
        need_way_to_save(session.profile, save=save)
        options = Options(line_settings, rating, codes_of(session, confirmed), rounded)
        values, messages = recipe.values if recipe else chosen, telling.messages
        if recipe is not None and recipe.left:
            messages.tell(f"left out, of a drive: {first_of(recipe.left, CODES_NAMED)}")
        if values is None:
            from ..running.predecessor import chosen_set

            path, values = await chosen_set(opened, session)
            found, status = await _tell(session, values, options, messages, line_text, path)
        elif dry_run:
            found, status = await _tell(session, values, options, messages)
        else:
            found, status = await _restore(session, values, options, telling, save=save)
        document = RestoreDocument(
            **drive_fields(line_text, session),
            dry_run=dry_run,
            **found,
            messages=telling.messages.texts,
        )
        return document, status

    first, *others = devices or recipes
    where = Target(line_text, first, profile_id, others=tuple(others))
    try:
        on_each_drive(where, restore_drive, as_json=as_json, read_only=read_only or dry_run)
    except KeyboardInterrupt:
        if dry_run:
            raise
        raise telling.interrupted() from None


def _either(*, dry_run: bool, arm: bool) -> None:
    if not dry_run:
        need_arming(arm, "restore writes settings of the drive")
    elif arm:
        raise click.UsageError("Give either --dry-run or --arm.")


async def _tell(
    session: DriveSession,
    values: ParameterSet,
    options: Options,
    messages: Messages,
    line_text: str = "",
    newest: Path | None = None,
) -> tuple[_Restored, int]:
    """Report the plan; for the `newest` backup also its drive, and the next commands."""
    from tui.drive.profile import library
    from tui.drive.settings.restore_planner import plan_restore
    from tui.session.settings.restore import held_by

    source = library.load(values.head.profile)
    held = await held_by(session, counter())
    plan = plan_restore(session.profile, held, values, source, options)
    if newest is not None:
        from ..running.predecessor import say_predecessor

        say_predecessor(session, held, source, values, messages)
    say_plan(session, plan, messages)
    if newest is not None:
        from ..running.predecessor import say_next_commands

        say_next_commands(line_text, session, newest, plan, messages)
    return _restored(plan), DONE


def _restored(
    plan: RestorePlan,
    results: Sequence[Result] = (),
    *,
    saved: bool = False,
    left: Iterable[Edit] = (),
) -> _Restored:
    from ..documents.parts import PlanItemField

    return {
        "plan": [
            PlanItemField(
                code=item.code,
                kind=item.kind,
                reason=item.reason or None,
                text=item.text or None,
                old=item.old or None,
                new=item.new or None,
            )
            for item in plan.items
            if item.reason != "no setting"
        ],
        "same_rating": plan.same_rating,
        "needs_stop": plan.needs_stop,
        "across": plan.across,
        "mapped_by": plan.mapped_by or None,
        "results": result_fields(results),
        "saved": saved,
        "left": [edit.code for edit in left],
    }


def say_plan(session: DriveSession, plan: RestorePlan, messages: Messages) -> None:
    """Report the plan: writes in their order, and omitted settings with the reason."""
    from tui.drive.settings.edits import commander_changes
    from tui.drive.settings.write_sequence import ordered

    items = {item.code: item for item in plan.items_of_kind("write")}
    held = {edit.code: edit.old for edit in plan.edits if edit.old is not None}
    for edit in ordered(session.profile, plan.edits, held):
        item = items[edit.code]
        text = f"write  {item.code}: {item.old} -> {item.new}  {item.text}"
        messages.tell(text.rstrip(), indent=7)
    left: dict[str, list[RestoreItem]] = {}
    for item in plan.items_of_kind("skip"):
        if item.reason != "no setting":
            left.setdefault(item.text, []).append(item)
    for text, same in left.items():
        if len(same) > ALIKE:
            values = f"{len(same)} {first_of([item.code for item in same], CODES_NAMED)}"
        else:
            values = ", ".join(f"{item.code} {item.new}".rstrip() for item in same)
        messages.tell(f"leave  {values}: {text}")
    if plan.same_rating is False and not plan.across:
        messages.tell("The set is of another model or rating than this drive.")
    if plan.across:
        messages.tell(ACROSS_TABLE if plan.mapped_by else ACROSS_QUANTITIES)
    if plan.mapped_by:
        messages.tell(f"Source of the table: {sentence(plan.mapped_by)}")
    for text in commander_changes(session.profile, plan.edits):
        messages.tell(text)
    counts = (
        f"{plan.count('write')} to write, {plan.count('equal')} equal already,"
        f" {plan.count('skip')} left out."
    )
    messages.tell(f"{counts} Some of it needs the motor stopped." if plan.needs_stop else counts)


async def _restore(
    session: DriveSession,
    values: ParameterSet,
    options: Options,
    telling: ResultTelling,
    *,
    save: bool,
) -> tuple[_Restored, int]:
    from tui.drive.profile import library
    from tui.session.settings.eeprom import refuse_frequent_save, save_to_eeprom
    from tui.session.settings.restore import Mark, plan_for
    from tui.session.settings.restore import restore_set as bring_back

    source, messages = library.load(values.head.profile), telling.messages
    if session.line.read_only:
        plan = await plan_for(session, values, source, options, counter())
        if len(plan.edits) or save:
            raise RequestRefused("The line is read-only: nothing is written.")
        say_plan_left_out(plan, messages)
        messages.tell(_nothing_text(plan))
        return _restored(plan), DONE
    if interrupted_before := Mark.of(session).interrupted:
        messages.tell(interrupted_before)
    journal, permit = journal_document(), permit_of(session)
    try:
        gate = wear_gate(journal, options.confirmed, messages)
        if save:
            planned: list[str] = []
            if any(p.eeprom_address is not None for p in session.profile.parameters):
                plan = await plan_for(session, values, source, options, counter())
                planned = [edit.code for edit in plan.edits]
            await refuse_frequent_save(session, gate, planned)
        done = await bring_back(
            session, journal, values, source, options, permit=permit,
            progress=telling, reading=counter(), gate=gate,
        )  # fmt: skip
        say_plan_left_out(done.plan, messages)
        for link in done.links:
            messages.tell(link.text)
        saved = save and done.complete
        if saved:
            messages.tell(await save_to_eeprom(session, journal, permit, gate))
        say_afterwards(messages, session.profile, done.after_reset, done.unsaved, saved=saved)
        messages.tell(_result_text(done))
        if done.unseen:
            messages.complain(f"Not all of it was seen again: {done.unseen}")
        if not done.complete:
            messages.complain("The same command writes what is missing.")
    finally:
        close_journal(journal)
    found = _restored(done.plan, done.results, saved=saved, left=done.left)
    if done.unseen:
        return found, LINE_TROUBLE
    return found, DONE if done.complete else status_of_results(done.results) or DRIVE_REFUSED


HOLDS_ALREADY = "The drive holds these values already."


def _nothing_text(plan: RestorePlan) -> str:
    """Return the result of a plan without a value to write."""
    return HOLDS_ALREADY if any(plan.items_of_kind("equal")) else "Nothing written."


def _result_text(done: Restored) -> str:
    """Return how many settings were written, and how many of the set were not."""
    from tui.session.settings.applied import done_text

    wrote = done_text((result for result in done.results if result.done), seen=not done.unseen)
    if done.complete and not wrote:
        return _nothing_text(done.plan)
    return f"{wrote or 'Nothing written.'} {len(done.left)} not written."


def say_plan_left_out(plan: RestorePlan, messages: Messages) -> None:
    """Report omitted settings by reason, and each rounding, as a person wrote these values by
    hand."""
    reasons: dict[str, list[str]] = {}
    for item in plan.items_of_kind("skip"):
        if item.reason == "rounding":
            messages.tell(f"left out: {sentence(item.text)} Use --round to write it anyway.")
        elif item.reason != "no setting":
            reasons.setdefault(item.reason, []).append(item.code)
    for item in plan.items_of_kind("write"):
        if item.text:
            messages.tell(item.text)
    for reason, codes in reasons.items():
        messages.tell(f"left out, {reason}: {first_of(codes, CODES_NAMED)}")
