"""`drivepanel profiles`: which drives the panel knows."""

from __future__ import annotations

from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING

import click
import msgspec

from tui.drive.errors import ProfileError
from tui.drive.plain import plain
from tui.drive.profile.profile import Profile, is_verified, notations, proof_text
from tui.drive.values import raw_range

from ..shared.completion import complete_profile
from ..shared.drive_commands import arm_option, need_arming
from ..shared.errors import DIFFERENT, end_with
from ..shared.line_argument import named_line_of
from ..shared.options import SLAVE_ADDRESS, Target, json_option
from ..shared.registration import WRITING, command
from ..shared.rows import GAP, Column, row_text, table_of
from ..shared.say import say
from ..shared.sets import refuse_output
from ..shared.standard_streams import given_file

if TYPE_CHECKING:
    from tui.drive.profile.library import Listing

PARAMETER_COLUMNS = (
    Column("Code"),
    Column("Name", readable=16),
    Column("Number"),
    Column("Wire address"),
    Column("Unit"),
    Column("Raw range"),
    Column("Access", readable=8),
    Column("Group", readable=16),
)


@command(
    "List, show, check or confirm drive profiles.",
    group="Profiles",
    statuses=(DIFFERENT, *WRITING),
)
@click.argument(
    "profile_id",
    required=False,
    metavar="[ID|new NEW-ID|confirm ID LINE [CODE...]|path]",
    shell_complete=complete_profile,
)
@click.argument("more", nargs=-1, metavar="")
@click.option(
    "--check",
    "file",
    type=click.Path(path_type=Path),
    metavar="FILE...",
    help="Check profile files and list each error with its line.",
)
@click.option(
    "--prove",
    "proved",
    type=click.Path(path_type=Path),
    metavar="FILE...",
    help="Test profile files on the drives simulated from them.",
)
@click.option("--line", "line_text", metavar="LINE", help="Test it on a drive on this line, too.")
@arm_option
@click.option("--without-motor", is_flag=True, help="Run the output; the motor is disconnected.")
@click.option("--from", "origin", metavar="ID", help="Copy this profile; for new.")
@click.option(
    "--from-csv",
    "table",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Begin with the parameters of this table; for new.",
)
@click.option(
    "--from-eds",
    "sheet",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Begin with the objects of this EDS or DCF; for new.",
)
@click.option(
    "--address-rule",
    "rules",
    multiple=True,
    metavar="RULE",
    help="Use this rule for addresses; for --from-csv, --from-eds.",
)
@click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    metavar="ADDRESS",
    help="Use the drive at this slave address (default: 1).",
)
@click.option(
    "--to",
    "to",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Write the evidence to this file; for confirm.",
)
@click.option("--force", is_flag=True, help="Replace the file of --to if it exists.")
@click.option("--schema", is_flag=True, help="Print the JSON schema: every field, described.")
@click.option(
    "--wiring",
    is_flag=True,
    help="Show warnings, wiring, LEDs, command words and errata.",
)
@json_option
def profiles(
    profile_id: str | None,
    more: tuple[str, ...],
    file: Path | None,
    proved: Path | None,
    line_text: str | None,
    arm: bool,
    without_motor: bool,
    origin: str | None,
    device: int | None,
    to: Path | None,
    force: bool,
    table: Path | None,
    sheet: Path | None,
    rules: tuple[str, ...],
    schema: bool,
    wiring: bool,
    as_json: bool,
) -> None:
    """List the profiles, show one, check files, or create one of your own.

    `path` shows the folder for your own profiles; `new NEW-ID --from ID` creates one there, and
    `new NEW-ID --from-csv FILE` one from the parameter table of a manual. `new NEW-ID --from-eds
    FILE --address-rule RULE` creates one from a data sheet of CANopen (EDS, DCF).
    `confirm ID LINE` compares a drive with its profile and writes the result to a file. It only
    reads. A person is asked what the display shows, for each CODE or for the usual values.
    """
    if wiring and profile_id in (None, "new", "path", "confirm"):
        raise click.UsageError("--wiring is of one profile: name its ID.")
    from tui.drive.profile import library

    words = (*((profile_id,) if profile_id is not None else ()), *more)
    confirms, proves_on_drive = words[:1] == ("confirm",), line_text is not None
    _refuse_stray(
        device=device is not None and not (confirms or proves_on_drive),
        to=(to is not None or force) and not confirms,
    )
    if line_text is not None:
        from ..running.profile_proof import prove_on_line
        from .accept import accept_test

        need_arming(arm, "this runs the output of the drive")
        target = Target(line_text, device or 1, None)
        prove_on_line(proved, words, target, accept_test, as_json, without_motor=without_motor)
    elif proved is not None:
        from ..running.profile_proof import prove_files

        prove_files([given_file(path) for path in (proved, *map(Path, words))], as_json)
    elif file is not None:
        from ..running.profile_proof import check_files

        check_files([given_file(path) for path in (file, *map(Path, words))], as_json)
    elif schema:
        from tui.drive.profile.json_schema import schema_text

        say(schema_text().rstrip())
    elif words[:1] == ("new",):
        from ..running.new_profile import begin_profile

        begin_profile(words[1:], origin, table, sheet, rules, as_json)
    elif words[:1] == ("confirm",):
        _confirm(words[1:], device, to, force=force, as_json=as_json)
    elif more or rules or any(part is not None for part in (origin, table, sheet)):
        raise click.UsageError("Name one ID, or: profiles new NEW-ID --from ID.")
    elif profile_id == "path":
        _tell_folder(as_json)
    elif profile_id is not None and wiring:
        _show_wiring(library.load(profile_id), as_json)
    elif profile_id is not None:
        _show(library.load(profile_id), as_json)
    else:
        _list(as_json)


def _confirm(
    words: tuple[str, ...], device: int | None, to: Path | None, *, force: bool, as_json: bool
) -> None:
    """Compare a drive with its profile; the status is 1 if it contradicts a statement."""
    if len(words) < 2:
        raise click.UsageError("Name a profile and a line: profiles confirm ID LINE.")
    from ..running.confirming import confirm_profile

    profile_id, line, *codes = words
    if (named := named_line_of(line)) is not None:
        line, device = named.line, device or named.device
    if force and to is None:
        raise click.UsageError("--force requires --to FILE.")
    if to is not None:
        refuse_output(to, force=force, as_json=as_json)
    target = Target(line, device or 1, profile_id)
    end_with(confirm_profile(target, codes, to, force=force, as_json=as_json))


def _refuse_stray(*, device: bool, to: bool) -> None:
    """Raise UsageError if an option of `confirm` is given for something else."""
    if device or to:
        raise click.UsageError("-d, --to and --force are for: profiles confirm ID LINE.")


def _tell_folder(as_json: bool) -> None:
    from tui.drive.profile import library

    from ..documents.other_documents import ProfileFolder
    from ..shared.output import print_json

    folder = str(library.user_folder())
    if as_json:
        print_json(ProfileFolder(folder=folder))
    else:
        say(folder)


def _list(as_json: bool) -> None:
    from tui.drive.profile import library

    from ..documents.other_documents import ProfileDocument
    from ..shared.output import print_json

    found = [*library.all_files(), *library.public_listings()]
    if as_json:
        print_json(
            [
                ProfileDocument(
                    id=listing.id,
                    name=listing.name,
                    vendor=listing.vendor,
                    parameters=listing.parameters,
                    own=listing.own,
                    file=str(listing.path),
                    remark=_remark(listing),
                )
                for listing in found
            ]
        )
        return
    rows = [(item.id, item.vendor, item.name) for item in found]
    widths = [max(map(len, texts)) for texts in zip(*rows, strict=True)]
    columns = (*(Column(width=width) for width in widths), Column(width=15, right=True), Column())
    for listing, row in zip(found, rows, strict=True):
        remark = _remark(listing)
        cells = (*row, f"{listing.parameters} parameters", f"({remark})" if remark else "")
        say(row_text(columns, cells), indent=widths[0] + GAP)


def _remark(listing: Listing) -> str:
    """Return the remark on a file: its owner, broken, or overridden."""
    from tui.drive.profile import library

    if listing.hidden_by is not None:
        return f"not used, {listing.hidden_by.name} has the same id"
    if listing.path.parent.name == library.PUBLIC and not listing.own:
        return f"broken: {listing.fault}" if listing.fault else _public_remark(listing)
    if not listing.own:
        return f"broken: {listing.fault}" if listing.fault else ""
    faults = [listing.fault] if listing.fault else library.faults_of(listing.path)
    if faults:
        return f"your own, broken: {faults[0].splitlines()[0]}"
    return "your own"


def _public_remark(listing: Listing) -> str:
    """Return that a profile is public, and what the evidence of this site has proved of it."""
    from tui.drive.profile import library

    if not library.evidence_folder().is_dir():
        return "public, unproved"  # nothing else needs the whole file
    try:
        return f"public, unproved: {proof_text(library.load(listing.id))}"
    except ProfileError as error:
        return f"broken: {error}"


def _show_wiring(profile: Profile, as_json: bool) -> None:
    from tui.drive.family_page import family_page, page_lines

    from ..documents.other_documents import WiringDocument, WiringRowField, WiringSectionField
    from ..shared.output import print_json

    sections = family_page(profile)
    if as_json:
        fields = [
            WiringSectionField(
                title=section.title,
                rows=[
                    WiringRowField(head=row.head, text=row.text, sure=row.sure, warns=row.warns)
                    for row in section.rows
                ],
            )
            for section in sections
        ]
        print_json(WiringDocument(id=profile.id, name=profile.name, sections=fields))
        return
    say(plain(f"{profile.vendor} {profile.name}"))
    for line in page_lines(sections, min(100, get_terminal_size().columns)):
        say(f"{line.head}{line.text}".rstrip())


_FUNCTIONS = {
    (False, False): "{of.code:>2}  {of.name}",
    (True, False): "{of.code:>2}  {of.name}, at most {of.max_read} {unit} read, past that {above}",
    (False, True): "{of.code:>2}  {of.name}, at most {of.max_write} {unit} written, past that"
    " {above}",
    (True, True): "{of.code:>2}  {of.name}, at most {of.max_read} {unit} read and {of.max_write}"
    " {unit} written, past that {above}",
}
"""By whether a function has a limit of the words that it reads and writes."""
_UNITS = {1: "coils", 2: "inputs", 15: "coils"}
_ABOVE_LIMIT = {True: "no answer", False: "an exception"}
"""By whether the drive is silent above the limit."""


def _show(profile: Profile, as_json: bool) -> None:
    from ..shared.output import console, print_json

    if as_json:
        from ..documents.other_documents import ProfileShown

        print_json(ProfileShown(**msgspec.to_builtins(profile.data)))
        return
    link = profile.data.link
    screen = console()
    screen.print(
        f"{profile.vendor} {profile.name}, factory line {link.baud} {link.format}", highlight=False
    )
    for function in profile.data.functions:
        text = _FUNCTIONS[bool(function.max_read), bool(function.max_write)]
        above = _ABOVE_LIMIT[function.past_limit == "silence"]
        text = text.format(of=function, above=above, unit=_UNITS.get(function.code, "words"))
        screen.print(f"  function {text}", highlight=False)
    rows = []
    for parameter in profile.parameters:
        code, number, wire = notations(parameter)
        low, high = raw_range(parameter)
        limits = "text" if parameter.type == "ascii" else f"{low}..{high}"
        mark = "" if is_verified(parameter) else " ?"
        head = (f"{code}{mark}", parameter.name, number, wire, parameter.unit, limits)
        rows.append((*head, parameter.access, parameter.group))
    screen.print(table_of(PARAMETER_COLUMNS, rows))
