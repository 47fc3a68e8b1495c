"""`drivepanel write`: settings of a drive, in engineering values."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..shared.errors import DONE, REFUSED_HERE, told
from ..shared.options import (
    Target,
    connect_drive,
    line_argument,
    on_line,
    read_only_option,
    settings_options,
)
from ..shared.say import say
from ..shared.sets import (
    codes_of,
    confirm_option,
    dry_run_option,
    save_option,
    say_afterwards,
    say_result,
    status_of_results,
)
from .orders import arm_option, close_journal, need_arming, permit_of, told_journal

if TYPE_CHECKING:
    from tui.drive.settings.edits import Edits
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession


@click.command()
@line_argument
@click.argument("wanted", nargs=-1, required=True, metavar="CODE=VALUE...")
@dry_run_option
@arm_option
@confirm_option
@save_option
@read_only_option
@settings_options
@told
def write(
    target: Target,
    wanted: tuple[str, ...],
    dry_run: bool,
    arm: bool,
    confirmed: tuple[str, ...],
    save: bool,
    read_only: bool,
) -> None:
    """Write settings of a drive, each read back: ACC=3.5s HSP=50 CHCF=Separate.

    A VALUE is a number with or without its unit, a name as the profile gives it, or a word in
    hexadecimal (16#0021). Limits and scales are written before what depends on them.
    """
    typed = _pairs(wanted)
    if not dry_run:
        need_arming(arm, "this writes settings of the drive")

    async def work(opened: OpenLine) -> int:
        session = await connect_drive(opened, target)
        edits = await _staged(session, typed)
        if dry_run:
            told = await _past_limits(session, edits)
            for edit in edits:
                if edit.code in told:
                    say(f"refuse {told[edit.code]}")
                else:
                    say(f"write  {edit.code}: {edit.old_text} -> {edit.text}")
            return REFUSED_HERE if told else DONE
        return await _write(session, edits, confirmed, save=save)

    status = on_line(target, work, read_only=read_only or dry_run)
    if status != DONE:
        raise click.exceptions.Exit(status)


def _pairs(wanted: tuple[str, ...]) -> list[tuple[str, str]]:
    pairs = []
    for text in wanted:
        code, sign, value = text.partition("=")
        if not sign or not code.strip() or not value.strip():
            raise click.UsageError(f"{text!r} is not written CODE=VALUE, like ACC=3.5s.")
        pairs.append((code.strip(), value.strip()))
    return pairs


async def _staged(session: DriveSession, typed: list[tuple[str, str]]) -> Edits:
    """The edits against what the drive holds; what is to be known of them is said."""
    from tui.drive.errors import ValueRefused
    from tui.drive.settings.edits import Edits, consequences
    from tui.drive.shown import scale_sources
    from tui.session.read.retrying_reader import RetryingReader

    profile = session.profile
    pairs = [(profile.find(code).code, value) for code, value in typed]
    sources = scale_sources(profile)
    follow = [p.code for p in profile.parameters if p.scale_by and {c for c, _ in pairs} & sources]
    retrying = RetryingReader(session)
    await retrying.ask_many([code for code, _ in pairs] + sorted(sources) + follow)
    edits = Edits()
    # scale sources first: what is typed for a ramp holds under the new scale
    for code, value in sorted(pairs, key=lambda pair: pair[0] not in sources):
        if profile[code].access == "r":
            raise ValueRefused(f"{code} can only be read.")
        edits = edits.stage(profile, code, value, retrying.raws, retrying.lacking)
    for edit in edits.asked:
        if edit.remark:
            say(edit.remark)
    for text in consequences(profile, edits, retrying.raws, retrying.lacking):
        say(text)
    return edits


async def _past_limits(session: DriveSession, edits: Edits) -> dict[str, str]:
    """By code, why an edit would be refused: a limit that another parameter sets."""
    from tui.drive.settings.limits import edit_problems, limit_sources
    from tui.drive.shown import depends_on
    from tui.session.read.retrying_reader import RetryingReader

    profile, codes = session.profile, {edit.code for edit in edits}
    codes |= limit_sources(profile, codes)
    codes |= {code for one in codes for code in depends_on(profile[one])}
    return edit_problems(profile, edits, await RetryingReader(session).ask_many(sorted(codes)))


async def _write(
    session: DriveSession, edits: Edits, confirmed: tuple[str, ...], *, save: bool
) -> int:
    from tui.session.settings.apply import apply_edits
    from tui.session.settings.eeprom import save_to_eeprom

    if not len(edits):
        say("The drive holds these values already.")
    journal, permit = told_journal(), permit_of(session)
    try:
        done = await apply_edits(
            session,
            journal,
            edits,
            permit=permit,
            confirmed=codes_of(session, confirmed),
            progress=say_result,
        )
        for link in done.links:
            say(link.text)
        saved = save and len(done.written) == len(done.results) and not done.stopped
        if saved:
            say(await save_to_eeprom(session, journal, permit))
        say_afterwards(done.after_reset, done.unsaved, saved=saved)
        return status_of_results(done.results)
    finally:
        close_journal(journal)
