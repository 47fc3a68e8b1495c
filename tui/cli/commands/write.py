"""`drivepanel write`: settings of a drive, in engineering values."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

import click

from tui.drive.errors import ValueRefused

from ..shared.asking import wear_gate
from ..shared.completion import complete_setting
from ..shared.drive_commands import (
    arm_option,
    close_journal,
    journal_document,
    need_arming,
    permit_of,
)
from ..shared.errors import DONE, USAGE, end_with
from ..shared.options import (
    Target,
    connect_drive,
    force_profile_option,
    json_option,
    line_argument,
    on_line,
    read_only_option,
    settings_options,
)
from ..shared.registration import WRITING, command
from ..shared.say import Messages
from ..shared.sets import (
    ResultTelling,
    codes_of,
    confirm_option,
    dry_run_option,
    edit_field,
    need_way_to_save,
    result_fields,
    round_option,
    save_option,
    say_afterwards,
    status_of_results,
)

if TYPE_CHECKING:
    from tui.drive.settings.edits import Edits
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.parts import EditField, OutcomeText


WOULD_BE_HELD_BACK = "{code} depends on {base}, which would not be written."


class _Written(TypedDict):
    """The fields of the document about the results."""

    results: list[EditField]
    saved: bool
    after_reset: list[str]
    unsaved: list[str]


@command("Write settings to a drive.", group="Set up", statuses=WRITING, acts=True)
@line_argument
@click.argument(
    "wanted",
    nargs=-1,
    required=True,
    metavar="CODE=VALUE...",
    shell_complete=complete_setting,
)
@dry_run_option
@arm_option
@confirm_option
@round_option
@save_option
@force_profile_option
@read_only_option
@json_option
@settings_options
def write(
    target: Target,
    wanted: tuple[str, ...],
    dry_run: bool,
    arm: bool,
    confirmed: tuple[str, ...],
    rounded: bool,
    save: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Write settings of a drive, each read back: ACC=3.5s HSP=50 CHCF=Separate.

    A VALUE is a number, with or without a unit (3.5s, 3500ms), a name from the profile, or a word
    in hexadecimal (16#0021). A value that rounding would make 0, or that is half way between two,
    is refused without --round. Limits and scales are written before settings that depend on them.
    """
    from ..documents.setting_documents import WriteDocument
    from ..shared.output import drive_fields, print_json

    typed = _pairs(wanted)
    if not dry_run:
        need_arming(arm, "this writes settings of the drive")
    messages = Messages(as_json=as_json)
    telling = ResultTelling(messages)

    async def work(opened: OpenLine) -> int:
        session = await connect_drive(opened, target)
        edits = await _staged(session, typed, messages, rounded=rounded)
        codes = [edit.code for edit in edits]
        need_way_to_save(session.profile, codes, save=save)
        if dry_run:
            found, status = await _tell(session, edits, messages)
        else:
            allowed = codes_of(session, confirmed)
            found, status = await _write(session, edits, allowed, telling, save=save)
        if as_json:
            print_json(
                WriteDocument(
                    **drive_fields(target.line_text, session),
                    dry_run=dry_run,
                    **found,
                    messages=messages.texts,
                )
            )
        return status

    try:
        status = on_line(target, work, read_only=read_only or dry_run)
    except KeyboardInterrupt:
        if dry_run:
            raise
        raise telling.interrupted() from None
    end_with(status)


def _pairs(wanted: tuple[str, ...]) -> list[tuple[str, str]]:
    pairs = []
    for text in wanted:
        code, sign, value = text.partition("=")
        if not sign or not code.strip() or not value.strip():
            raise click.UsageError(f"{text!r} is not written CODE=VALUE, like ACC=3.5s.")
        pairs.append((code.strip(), value.strip()))
    return pairs


async def _staged(
    session: DriveSession, typed: list[tuple[str, str]], messages: Messages, *, rounded: bool
) -> Edits:
    """The edits against the values of the drive; remarks and consequences are reported.

    Raises ValueRefused if a parameter is never written as a setting, or if a value would be rounded
    to another one without --round.
    """
    from tui.drive.settings.edits import consequences
    from tui.drive.settings.writable import write_refusal
    from tui.session.settings.typed import WouldRound, stage_typed

    profile = session.profile
    pairs = [(profile.find(code).code, value) for code, value in typed]
    codes = [code for code, _ in pairs]
    if twice := ", ".join(code for code in dict.fromkeys(codes) if codes.count(code) > 1):
        raise click.UsageError(f"{twice}: given more than once. Which value is meant?")
    for code in codes:
        against = write_refusal(profile, profile[code], None)
        if against is not None and against.reason in ("forbidden", "read-only", "order"):
            raise ValueRefused(against.text)
    try:
        edits, retrying = await stage_typed(session, pairs, rounded=rounded)
    except WouldRound as loss:
        raise ValueRefused(f"{loss} Use --round to write it anyway.") from loss
    for edit in edits.requested:
        if edit.remark:
            messages.tell(edit.remark)
    for text in consequences(profile, edits, retrying.raws, retrying.lacking):
        messages.tell(text)
    return edits


async def _tell(session: DriveSession, edits: Edits, messages: Messages) -> tuple[_Written, int]:
    """Show what would be written; the same for JSON, and the exit status."""
    past, held_back = await _past_limits(session, edits)
    rows = []
    for edit in edits:
        why = past.get(edit.code) or held_back.get(edit.code)
        text = f"write  {edit.code}: {edit.old_text} -> {edit.text}"
        messages.tell(text if why is None else f"refuse {why}")
        outcome: OutcomeText = "would-write" if why is None else "refused"
        if edit.code in held_back:
            outcome = "held-back"
        rows.append(edit_field(edit, outcome=outcome, held=edit.old, text=why or text))
    found: _Written = {"results": rows, "saved": False, "after_reset": [], "unsaved": []}
    return found, USAGE if past else DONE


async def _past_limits(
    session: DriveSession, edits: Edits
) -> tuple[dict[str, str], dict[str, str]]:
    """Return why edits would be refused by limits of others, then why edits would be held back.

    Both are by code. An edit is held back if it depends on one that would not be written.
    """
    from tui.drive.settings.limits import builds_on, edit_problems, limit_sources
    from tui.drive.shown import depends_on
    from tui.session.read.retrying_reader import RetryingReader

    profile, codes = session.profile, {edit.code for edit in edits}
    codes |= limit_sources(profile, codes)
    codes |= {code for text in codes for code in depends_on(profile[text])}
    raws = await RetryingReader(session).ask_many(sorted(codes))
    past = edit_problems(profile, edits, raws)
    held_back: dict[str, str] = {}
    while True:
        missed = {*past, *held_back}
        more = {
            edit.code: WOULD_BE_HELD_BACK.format(code=edit.code, base=base)
            for edit in edits
            if edit.code not in missed and (base := builds_on(profile, edit, missed, edits, raws))
        }
        if not more:
            return past, held_back
        held_back |= more


async def _write(
    session: DriveSession,
    edits: Edits,
    confirmed: frozenset[str],
    telling: ResultTelling,
    *,
    save: bool,
) -> tuple[_Written, int]:
    """Write, report each; the results for JSON, and the exit status."""
    from tui.session.settings.apply import apply_edits
    from tui.session.settings.eeprom import refuse_frequent_save, save_to_eeprom

    messages = telling.messages
    if not len(edits):
        messages.tell("The drive holds these values already.")
        if session.line.read_only and not save:
            return {"results": [], "saved": False, "after_reset": [], "unsaved": []}, DONE
    journal, permit = journal_document(), permit_of(session)
    try:
        gate = wear_gate(journal, confirmed, messages)
        if save:
            await refuse_frequent_save(session, gate, [edit.code for edit in edits])
        done = await apply_edits(
            session, journal, edits, permit=permit, confirmed=confirmed, progress=telling, gate=gate
        )
        for link in done.links:
            messages.tell(link.text)
        saved = save and len(done.written) == len(done.results) and not done.stopped
        if saved:
            messages.tell(await save_to_eeprom(session, journal, permit, gate))
        say_afterwards(messages, session.profile, done.after_reset, done.unsaved, saved=saved)
    finally:
        close_journal(journal)
    found: _Written = {
        "results": result_fields(done.results),
        "saved": saved,
        "after_reset": list(done.after_reset),
        "unsaved": [] if saved else list(done.unsaved),
    }
    return found, status_of_results(done.results)
