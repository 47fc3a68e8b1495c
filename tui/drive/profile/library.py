"""Finding and loading of profiles, packaged ones and those of the user.

A listing reads only the first table of a packaged file, and counts its parameters: a large profile
costs nothing until it is used. A file of the user is read as a whole.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..errors import ProfileError, UnknownProfile
from .heads import RequestPrefixes, file_head, quick_head, request_prefixes

if TYPE_CHECKING:
    from .profile import Profile
    from .schema import HelpData, ProfileData
    from .toml_lines import TomlPath


class Listing(NamedTuple):
    """Facts about a profile in a list, read from the head of its file."""

    id: str
    name: str
    vendor: str
    version: str
    summary: str
    parameters: int
    path: Path
    own: bool
    """True for a profile in the user's folder."""
    fault: str = ""
    """Why the file cannot be used, if its head or its TOML is broken."""
    hidden_by: Path | None = None
    """File with the same id that replaces this one; None if this one is used."""


@cache
def packaged_folder() -> Path:
    """Return the folder of the packaged profiles, in a wheel or a checkout."""
    package = Path(__file__).resolve().parents[2]
    installed = package / "_profiles"
    return installed if installed.is_dir() else package.parent / "profiles"


def user_folder() -> Path:
    """Return the folder of the user's own profiles, in the configuration folder.

    `DRIVEPANEL_CONFIG` names another configuration folder. If the user has no home folder, the
    returned path does not exist.
    """
    if configured := os.environ.get("DRIVEPANEL_CONFIG"):
        return Path(configured) / "profiles"
    from platformdirs import user_config_path

    try:
        return user_config_path("drivepanel", appauthor=False) / "profiles"
    except RuntimeError:
        return Path(os.devnull) / "profiles"


def evidence_folder() -> Path:
    """Return the folder for evidence about profiles at this site, in the configuration folder."""
    return user_folder().parent / "evidence"


def submitted_folder() -> Path:
    """Return the folder for evidence that was submitted to the project."""
    return packaged_folder() / "evidence"


PUBLIC = "public"
"""Folder of the public profiles in that of the packaged ones."""


def profile_files() -> Iterator[tuple[Path, bool]]:
    """Return every profile file, with True for the user's own; the user's come first."""
    for folder, own in ((user_folder(), True), (packaged_folder(), False)):
        if folder.is_dir():
            for path in sorted(folder.glob("*.toml")):
                yield path, own


def public_listings() -> list[Listing]:
    """Return the profiles written from public documents that no drive has confirmed, by id.

    They are not among the `listings`: only `load` and an identity find them, so that no word of
    theirs is sent to a drive of another family. A profile of the user with the same id hides them.
    """
    folder = packaged_folder() / PUBLIC
    taken = {listing.id for listing in listings()}
    found = (_listing(path, False, folder) for path in folder.glob("*.toml"))
    return sorted(listing for listing in found if listing.id not in taken)


def factory_notes() -> list[str]:
    """Return a sentence for each public profile whose new drives do not answer, and the remedy.

    A file that cannot be used has none.
    """
    found = []
    for listing in public_listings():
        with suppress(ProfileError):
            if note := load(listing.id).data.link.at_factory:
                found.append(note)
    return found


def listings() -> list[Listing]:
    """Return all profiles by id; a user's profile replaces a packaged one with the same id.

    A file with an unreadable head is listed under its file name, so that it is seen. Using it
    reports the fault.
    """
    return [listing for listing in all_files() if listing.hidden_by is None]


def all_files() -> list[Listing]:
    """Return every profile file, sorted by id; a hidden file follows the one that hides it."""
    first: dict[str, Path] = {}
    found = []
    for path, own in profile_files():
        listing = _listing(path, own)
        found.append(listing._replace(hidden_by=first.get(listing.id)))
        first.setdefault(listing.id, path)
    return sorted(found, key=lambda listing: listing.id)


def _listing(path: Path, own: bool, folder: Path | None = None) -> Listing:
    head = file_head(path, own, folder or packaged_folder())
    return Listing(
        id=head.text("id") or path.stem,
        name=head.text("name") or path.stem,
        vendor=head.text("vendor"),
        version=head.text("version"),
        summary=head.text("summary"),
        parameters=head.parameters,
        path=path,
        own=own,
        fault=head.fault,
    )


@lru_cache(maxsize=32)
def load(profile_id: str) -> Profile:
    """Load and check the profile with this id.

    Raises UnknownProfile, or ProfileError with the file, the place and the fault.
    """
    for listing in (*listings(), *public_listings()):
        if listing.id == profile_id.strip().lower():
            return _with_evidence(load_file(listing.path))
    known = ", ".join(item.id for item in (*listings(), *public_listings()))
    raise UnknownProfile(f"There is no profile {profile_id!r}. Profiles: {known}.")


def _with_evidence(profile: Profile) -> Profile:
    """Return a profile with what evidence of this site proves."""
    if not (folder := evidence_folder()).is_dir():
        return profile
    from .evidence import all_evidence, with_evidence
    from .profile import Profile

    data = with_evidence(profile.data, all_evidence(folder))
    return profile if data is profile.data else Profile(data, profile.read_help)


def load_file(path: Path) -> Profile:
    """Load and check the profile in a file; raises ProfileError."""
    from .check import checked_data
    from .profile import Profile

    data = checked_data(path, packaged_folder())

    def read_help() -> HelpData:
        from .help_file import read_help

        return read_help(data, (path.resolve().parent, packaged_folder()))

    return Profile(data, read_help)


SHARED_TABLES = ("signal_paths", "schematics", "parts", "masters", "parameters")
"""Tables that the packaged profiles share, in the order of a file."""


def rows_with_shared(listing: Listing) -> dict[str, list[dict[str, Any]]] | None:
    """Return all rows of the shared tables of a profile; None if it shares no rows."""
    from .shared_rows import parsed, read_tables, source_text

    if "rows_from" not in parsed(source_text(listing.path)).get("profile", {}):
        return None
    tables = read_tables(listing.path, packaged_folder()).tables
    return {name: tables.get(name, []) for name in SHARED_TABLES}


def all_faults_of(path: Path) -> list[str]:
    """Return all faults of a profile file and of its files of help and search, if it has them."""
    from .check import examined
    from .help_file import read_help
    from .rules import CHECKED_RULES
    from .search_file import read_vocabulary

    try:
        data, faults = examined(path, packaged_folder(), (*CHECKED_RULES, _kinds_of_charts))
    except ProfileError as error:
        return [str(error)]
    reported = [str(fault) for fault in faults]
    if data is None:
        return reported
    folders = (path.resolve().parent, packaged_folder())
    for read in (read_help, read_vocabulary):
        try:
            read(data, folders)
        except ProfileError as error:
            reported += str(error).splitlines()
    return reported


def _kinds_of_charts(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield charts of a kind that is neither plain nor that of a packaged profile."""
    other = [(index, chart) for index, chart in enumerate(data.charts) if chart.kind != "plain"]
    if not other:
        return
    packaged = [load_file(path).data for path in sorted(packaged_folder().glob("*.toml"))]
    known = {chart.kind for profile in packaged for chart in profile.charts}
    for index, chart in other:
        if chart.kind not in known:
            yield (
                ("charts", index, "kind"),
                f"chart {chart.id}: there is no kind {chart.kind!r}. Allowed: plain,"
                f" {', '.join(sorted(known - {'plain'}))}. Omit it for a drive of your own.",
            )


def hints_of(path: Path) -> list[str]:
    """Return the probable mistakes of a profile file without faults, with file and line."""
    from .check import hints_in

    return [str(hint) for hint in hints_in(path, packaged_folder())]


def faults_of(path: Path) -> list[str]:
    """Return all faults of a profile file, with file and line; empty if it can be used."""
    from .check import examined

    try:
        return [str(fault) for fault in examined(path, packaged_folder())[1]]
    except ProfileError as error:
        return [str(error)]


def matching_profiles(reference: str) -> list[str]:
    """Return the ids of profiles whose reference prefixes fit a reported reference, best first."""
    return [profile_id for _, profile_id in _fits(reference)]


def best_profiles(reference: str) -> list[str]:
    """Return the ids of the profiles that fit a reported reference best; several fit equally."""
    fits = _fits(reference)
    return sorted(profile_id for longest, profile_id in fits if longest == fits[0][0])


def identified_profile(reference: str) -> str | None:
    """Return the profile that fits a reported reference best; None if several fit equally."""
    found = best_profiles(reference)
    return found[0] if len(found) == 1 else None


def _fits(reference: str) -> list[tuple[int, str]]:
    """Return the length of the fitting prefix, and the id, of each profile that fits, best
    first."""
    wanted = reference.strip().upper()
    fits: list[tuple[int, str]] = []
    for listing in (*listings(), *public_listings()):
        prefixes = identification_of(listing).prefixes
        longest = max((len(p) for p in prefixes if wanted.startswith(p.upper())), default=0)
        if longest:
            fits.append((longest, listing.id))
    return sorted(fits, reverse=True)


def identification_of(listing: Listing) -> RequestPrefixes:
    """Return how drives of a listed family are identified, without decoding the file."""
    folder = packaged_folder() if listing.own else listing.path.parent
    return request_prefixes(listing.path, listing.own, folder)


def mentions_function(listing: Listing, code: int) -> bool:
    """Return True if a profile declares a Modbus function, without decoding the file."""
    return code in identification_of(listing).functions


@lru_cache(maxsize=64)
def version_shown(profile_id: str | None, version: str) -> str:
    """Return a reported version as the family writes it: 0201 may be 2.1."""
    listing = next((item for item in listings() if item.id == profile_id), None)
    if listing is None or len(version) != 4 or not version.isdecimal():
        return version
    reported = identification_of(listing)
    if reported.version_digits != "two-and-two":
        return version
    return f"{int(version[:2])}.{int(version[2:])}"


def demo_drives() -> dict[str, tuple[str, float]]:
    """Return name and frequency in Hz of each motor of the demo, by profile id.

    Only the beginning of each file is read.
    """
    found: dict[str, tuple[str, float]] = {}
    for path, own in profile_files():
        head = quick_head(path, own)
        if head.demo_hz is not None and head.text("id"):
            found.setdefault(head.text("id"), (head.text("name"), head.demo_hz))
    return dict(sorted(found.items()))
