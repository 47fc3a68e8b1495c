"""`drivepanel restore`: a parameter set back into a drive."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import DONE, DRIVE_REFUSED, status_of, told
from ..shared.options import (
    Target,
    connect_drive,
    devices_option,
    line_argument,
    on_line,
    profile_option,
    read_only_option,
)
from ..shared.say import say
from ..shared.sets import (
    codes_of,
    confirm_option,
    counter,
    dry_run_option,
    file_argument,
    save_option,
    say_afterwards,
    say_result,
    set_in,
    status_of_results,
)
from .orders import arm_option, close_journal, need_arming, permit_of, told_journal

if TYPE_CHECKING:
    from tui.drive.settings.parameter_set import ParameterSet
    from tui.drive.settings.restore_plan import Options, RestorePlan
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

CODES_NAMED = 12
"""How many codes are named for one reason; --dry-run names all."""


@click.command()
@line_argument
@file_argument
@dry_run_option
@arm_option
@click.option("--line-settings", is_flag=True, help="Write address, baud and format too.")
@click.option("--rating", is_flag=True, help="Write rating and motor data to another model too.")
@confirm_option
@save_option
@read_only_option
@profile_option
@devices_option(
    "Slave address of the drive; several times for several drives.",
    default=(1,),
    show_default=True,
)
@told
def restore(
    line_text: str,
    file: Path,
    dry_run: bool,
    arm: bool,
    line_settings: bool,
    rating: bool,
    confirmed: tuple[str, ...],
    save: bool,
    read_only: bool,
    profile_id: str | None,
    devices: tuple[int, ...],
) -> None:
    """Bring a parameter set back into a drive: what differs is written and read back.

    With several -d the set goes to each of these drives in turn; one that cannot take it does
    not keep it from the others.

    --dry-run tells what would be written, what is left out, and why. An interrupted restoring
    is resumed by the same command: the drive is read, and what is missing is written.
    """
    if dry_run is arm:
        if not dry_run:
            need_arming(False, "restoring writes settings of the drive")
        raise click.UsageError("Give either --dry-run or --arm.")
    values = set_in(file)

    async def one(opened: OpenLine, device: int) -> int:
        from tui.drive.settings.restore_plan import Options

        session = await connect_drive(opened, Target(line_text, device, profile_id))
        codes = codes_of(session, confirmed)
        options = Options(line_settings, rating, codes)
        if dry_run:
            return await _tell(session, values, options)
        return await _restore(session, values, options, save=save)

    async def work(opened: OpenLine) -> int:
        if len(devices) == 1:
            return await one(opened, devices[0])
        return max([await _in_turn(opened, device, one) for device in devices])

    status = on_line(
        Target(line_text, devices[0], profile_id), work, read_only=read_only or dry_run
    )
    if status != DONE:
        raise click.exceptions.Exit(status)


async def _in_turn(
    opened: OpenLine, device: int, one: Callable[[OpenLine, int], Awaitable[int]]
) -> int:
    """One of several drives; what is wrong with it is told, and the next one is tried."""
    say(f"Device {device}:")
    try:
        return await one(opened, device)
    except click.ClickException as error:
        status, text = error.exit_code, error.format_message()
    except Exception as error:
        known = status_of(error)
        if known is None:
            raise
        status, text = known, str(error)
    say(f"drivepanel: device {device}: {text}", err=True)
    return status


async def _tell(session: DriveSession, values: ParameterSet, options: Options) -> int:
    from tui.drive.profile import library
    from tui.session.settings.restore import plan_for

    source = library.load(values.head.profile)
    plan = await plan_for(session, values, source, options, counter("Read"))
    say_plan(session, plan)
    return DONE


def say_plan(session: DriveSession, plan: RestorePlan) -> None:
    """The plan: what is written in its order, and what is left out with its reason."""
    from tui.drive.settings.write_sequence import ordered

    items = {item.code: item for item in plan.of_kind("write")}
    held = {edit.code: edit.old for edit in plan.edits if edit.old is not None}
    for edit in ordered(session.profile, plan.edits, held):
        item = items[edit.code]
        say(f"write  {item.code}: {item.old} -> {item.new}  {item.text}".rstrip())
    for item in plan.of_kind("skip"):
        if item.reason != "no setting":
            value = f" {item.new}" if item.new else ""
            say(f"leave  {item.code}{value}: {item.text}")
    if plan.same_rating is False and not plan.across:
        say("The set is of another model or rating than this drive.")
    if plan.across:
        say("The set is of another family: common quantities are carried over in their units.")
    stop = " Some of it needs the motor stopped." if plan.needs_stop else ""
    say(
        f"{plan.count('write')} to write, {plan.count('equal')} equal already,"
        f" {plan.count('skip')} left out.{stop}"
    )


async def _restore(
    session: DriveSession, values: ParameterSet, options: Options, *, save: bool
) -> int:
    from tui.drive.profile import library
    from tui.session.settings.eeprom import save_to_eeprom
    from tui.session.settings.restore import Mark
    from tui.session.settings.restore import restore_set as bring_back

    source = library.load(values.head.profile)
    if told_before := Mark.of(session).interrupted:
        say(told_before)
    journal, permit = told_journal(), permit_of(session)
    try:
        done = await bring_back(
            session, journal, values, source, options, permit=permit,
            progress=say_result, reading=counter("Read"),
        )  # fmt: skip
        say_plan_left_out(done.plan)
        for link in done.links:
            say(link.text)
        saved = save and done.complete
        if saved:
            say(await save_to_eeprom(session, journal, permit))
        say_afterwards(done.after_reset, done.unsaved, saved=saved)
        written = sum(result.done for result in done.results)
        say(f"{written} written and read back, {len(done.left)} not.")
        if done.complete:
            return DONE
        say("drivepanel: The same command writes what is missing.", err=True)
        return status_of_results(done.results) or DRIVE_REFUSED
    finally:
        close_journal(journal)


def say_plan_left_out(plan: RestorePlan) -> None:
    """What was left out, by reason."""
    reasons: dict[str, list[str]] = {}
    for item in plan.of_kind("skip"):
        if item.reason != "no setting":
            reasons.setdefault(item.reason, []).append(item.code)
    for reason, codes in reasons.items():
        more = f" and {len(codes) - CODES_NAMED} more" if len(codes) > CODES_NAMED else ""
        say(f"left out, {reason}: {', '.join(codes[:CODES_NAMED])}{more}")
