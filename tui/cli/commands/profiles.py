"""`drivepanel profiles`: which drives the panel knows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.drive.plain import plain

from ..shared.errors import told
from ..shared.options import json_option
from ..shared.say import say

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile


@click.command()
@click.argument("profile_id", required=False, metavar="[ID]")
@click.option(
    "--check",
    "file",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Check a profile file of your own.",
)
@click.option(
    "--wiring",
    is_flag=True,
    help="Of the profile: warnings, waiting time, pins, rules of the line, addresses, lamps,"
    " command words, and where the manuals are wrong.",
)
@json_option
@told
def profiles(profile_id: str | None, file: Path | None, wiring: bool, as_json: bool) -> None:
    """List the profiles, show one, or check a file."""
    if wiring and profile_id is None:
        raise click.UsageError("--wiring is of one profile: name its ID.")
    from tui.drive.profile import library

    if file is not None:
        checked = library.load_file(file)
        _ = checked.guide.data  # the help of its faults, with what is wrong there
        say(f"{file}: {checked.name}, {len(checked.parameters)} parameters, no fault found.")
    elif profile_id is not None and wiring:
        _show_wiring(library.load(profile_id), as_json)
    elif profile_id is not None:
        _show(library.load(profile_id), as_json)
    else:
        _list(as_json)


def _list(as_json: bool) -> None:
    from tui.drive.profile import library

    from ..shared.output import print_json

    found = library.listings()
    if as_json:
        keys = ("id", "name", "vendor", "parameters")
        print_json([{key: getattr(listing, key) for key in keys} for listing in found])
        return
    for listing in found:
        own = "  (your own)" if listing.own else ""
        say(
            f"{listing.id:<12} {listing.vendor:<20} {listing.name:<22}"
            f" {listing.parameters:>4} parameters{own}"
        )


def _show_wiring(profile: Profile, as_json: bool) -> None:
    from shutil import get_terminal_size

    from tui.drive.family_page import family_page, page_lines

    from ..shared.output import print_json

    sections = family_page(profile)
    if as_json:
        import msgspec

        told = [msgspec.to_builtins(section) for section in sections]
        print_json({"id": profile.id, "name": profile.name, "sections": told})
        return
    say(plain(f"{profile.vendor} {profile.name}"))
    for line in page_lines(sections, min(100, get_terminal_size().columns)):
        say(f"{line.head}{line.text}".rstrip())


def _show(profile: Profile, as_json: bool) -> None:
    from ..shared.output import console, print_json

    if as_json:
        import msgspec

        print_json(msgspec.to_builtins(profile.data))
        return
    from rich.table import Table

    from tui.drive.profile.profile import is_verified, notations
    from tui.drive.values import raw_range

    link = profile.data.link
    screen = console()
    screen.print(
        f"{profile.vendor} {profile.name}, factory line {link.baud} {link.format}", highlight=False
    )
    for function in profile.data.functions:
        past = "no answer" if function.past_limit == "silence" else "an exception"
        limits = [
            f"{words} words {what}"
            for what, words in (("read", function.max_read), ("written", function.max_write))
            if words
        ]
        most = f", at most {' and '.join(limits)}, past that {past}" if limits else ""
        screen.print(f"  function {function.code:>2}  {function.name}{most}", highlight=False)
    table = Table(box=None, pad_edge=False, header_style="dim")
    for title in ("Code", "Name", "Number", "Wire address", "Unit", "Raw range", "Access", "Group"):
        table.add_column(title)
    for parameter in profile.parameters:
        code, number, wire = notations(parameter)
        low, high = raw_range(parameter)
        table.add_row(
            code + ("" if is_verified(parameter) else " ?"),
            parameter.name,
            number,
            wire,
            parameter.unit,
            f"{low}..{high}",
            parameter.access,
            parameter.group,
        )
    screen.print(table)
