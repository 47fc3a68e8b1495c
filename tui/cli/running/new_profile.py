"""`profiles new`: the file of a new profile, from another one, a table, or a data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import USAGE, Failure
from ..shared.say import say
from ..shared.standard_streams import given_file

if TYPE_CHECKING:
    from tui.drive.profile.library import Listing


def begin_profile(
    words: tuple[str, ...],
    origin: str | None,
    table: Path | None,
    sheet: Path | None,
    rules: tuple[str, ...],
    as_json: bool,
) -> None:
    """Write the file of a new profile, never over a file.

    It is made from the profile `origin`, from a CSV table, or from a data sheet of CANopen with
    the address rules for its objects. Raises UsageError unless it is exactly one of them.
    """
    from tui.drive.profile import library

    from ..documents.other_documents import ProfileBegun
    from ..shared.output import print_json

    if rules and sheet is None and (table is None or len(rules) > 1):
        raise click.UsageError("--address-rule is for --from-eds, and once for --from-csv.")
    given = [given_file(path) for path in (table, sheet) if path is not None]
    if len(words) != 1 or len(given) + (origin is not None) != 1:
        raise click.UsageError(
            "Name the new id and the profile to copy, new NEW-ID --from ID, or a table, new NEW-ID"
            " --from-csv FILE or --from-eds FILE."
        )
    known = {item.id: item for item in (*library.listings(), *library.public_listings())}
    new_id = words[0].strip()
    if new_id in known:
        taken = known[new_id]
        text = f"There is a profile {new_id} already: {taken.path}."
        if taken.own:
            raise click.UsageError(f"{text} Use another id, or delete this file.")
        raise click.UsageError(f"{text} Use another id.")
    if sheet is not None:
        text = _from_eds(given[0], new_id, rules)
    else:
        text = (
            _from_table(given[0], new_id, rules) if given else _copied(known, origin or "", new_id)
        )
    start = origin.strip().lower() if origin is not None else str(given[0])
    path = library.user_folder() / f"{new_id}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise click.UsageError(
            f"{path} already exists; nothing was written. Use another id, or delete the file."
        ) from None
    if as_json:
        print_json(ProfileBegun(id=new_id, from_=start, file=str(path)))
        return
    say(f"{path}")
    if given:
        say(f"Its rows are those of {start}, with the certainty unverified. Add the commands.")
    else:
        say(f"It is a copy of {start}. Change it.")
    say(f"Then: drivepanel profiles --check {path}")


def _copied(known: Mapping[str, Listing], origin: str, new_id: str) -> str:
    """Return the text of a copy of a profile."""
    from tui.drive.profile import library
    from tui.drive.profile.new_file import new_profile_text
    from tui.drive.small_file import read_small_text

    library.load(origin)  # reports a broken profile, which cannot be copied
    source = known[origin.strip().lower()]
    rows = library.rows_with_shared(source)
    return new_profile_text(read_small_text(source.path), source.id, new_id, rows)


def _from_table(table: Path, new_id: str, rules: tuple[str, ...]) -> str:
    """Return the text of a profile with the rows of a table; a byte order mark is ignored."""
    from tui.drive.profile.csv_file import profile_from_table
    from tui.drive.small_file import encoding_fault, read_small

    try:
        data = read_small(table).removeprefix(b"\xef\xbb\xbf")
    except OSError as error:
        raise Failure(f"{table}: cannot be read: {error.strerror}.", USAGE) from error
    if fault := encoding_fault(data):
        raise Failure(f"{table}:{fault}", USAGE)
    return profile_from_table(data.decode("utf-8"), new_id, str(table), "".join(rules))


def _from_eds(sheet: Path, new_id: str, rules: tuple[str, ...]) -> str:
    """Return the text of a profile with the objects of a data sheet."""
    from tui.drive.profile.eds_file import profile_from_eds
    from tui.drive.small_file import read_small

    try:
        data = read_small(sheet)
    except OSError as error:
        raise Failure(f"{sheet}: cannot be read: {error.strerror}.", USAGE) from error
    return profile_from_eds(data, new_id, str(sheet), rules)
