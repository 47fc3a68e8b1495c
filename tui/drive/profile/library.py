"""Finding and loading profiles: those that come with the panel and the user's own.

A listing reads the first table of a file and counts its parameters, no more: a large profile
costs nothing until it is used.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ..errors import ProfileError, UnknownProfile
from .profile import Profile
from .schema import HelpData

_HEAD_KEY = re.compile(r'^(id|name|vendor|version|summary)\s*=\s*"((?:[^"\\]|\\.)*)"', re.MULTILINE)
_NEXT_TABLE = re.compile(r"^\[(?!profile\])", re.MULTILINE)
_PARAMETER = re.compile(r"^\[\[parameters\]\]", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Listing:
    """What a listing shows of a profile, read from the head of its file."""

    id: str
    name: str
    vendor: str
    version: str
    summary: str
    parameters: int
    path: Path
    own: bool
    """True for a profile of the user's own folder."""


def packaged_folder() -> Path:
    """The folder of the profiles that come with the panel, in a wheel or a checkout."""
    package = Path(__file__).resolve().parents[2]
    installed = package / "_profiles"
    return installed if installed.is_dir() else package.parent / "profiles"


def user_folder() -> Path:
    """The folder of the user's own profiles, in the configuration folder.

    `DRIVEPANEL_CONFIG` names another configuration folder.
    """
    if configured := os.environ.get("DRIVEPANEL_CONFIG"):
        return Path(configured) / "profiles"
    from platformdirs import user_config_path

    return user_config_path("drivepanel", appauthor=False) / "profiles"


def profile_files() -> Iterator[tuple[Path, bool]]:
    """Every profile file with whether it is the user's own; the user's come first."""
    for folder, own in ((user_folder(), True), (packaged_folder(), False)):
        if folder.is_dir():
            for path in sorted(folder.glob("*.toml")):
                yield path, own


def listings() -> list[Listing]:
    """All profiles by id; a user's profile takes the place of a packaged one with its id.

    A file whose head cannot be read is listed under its file name, so that it is seen; using
    it then tells the fault.
    """
    found: dict[str, Listing] = {}
    for path, own in profile_files():
        listing = _listing(path, own)
        found.setdefault(listing.id, listing)
    return [found[key] for key in sorted(found)]


def _listing(path: Path, own: bool) -> Listing:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return Listing(path.stem, path.stem, "", "", "cannot be read", 0, path, own)
    end = _NEXT_TABLE.search(text)
    head = dict(_HEAD_KEY.findall(text[: end.start() if end else len(text)]))
    return Listing(
        id=head.get("id", path.stem),
        name=head.get("name", path.stem),
        vendor=head.get("vendor", ""),
        version=head.get("version", ""),
        summary=head.get("summary", ""),
        parameters=len(_PARAMETER.findall(text)),
        path=path,
        own=own,
    )


@lru_cache(maxsize=32)
def load(profile_id: str) -> Profile:
    """The profile with this id, read and checked.

    Raises UnknownProfile, or ProfileError with the file, the place and the fault.
    """
    for listing in listings():
        if listing.id == profile_id.strip().lower():
            return load_file(listing.path)
    known = ", ".join(item.id for item in listings())
    raise UnknownProfile(f"There is no profile {profile_id!r}. Profiles: {known}.")


def load_file(path: Path) -> Profile:
    """The profile in a file, checked strictly; raises ProfileError."""
    from .check import check
    from .decode import decode_profile

    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ProfileError(f"{path}: cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise ProfileError(f"{path}: byte {error.start} is not UTF-8 text.") from error
    data = decode_profile(text, str(path))
    check(data, str(path), text)

    def read_help() -> HelpData:
        from .help_file import read_help

        return read_help(data, (path.resolve().parent, packaged_folder()))

    return Profile(data, read_help)


def matching_profiles(reference: str) -> list[str]:
    """Ids of the profiles whose reference beginnings fit an identification, best first.

    Reads only the line with `reference_prefixes` of each file.
    """
    wanted = reference.strip().upper()
    fits: list[tuple[int, str]] = []
    for listing in listings():
        longest = max(
            (len(p) for p in _prefixes(listing.path) if wanted.startswith(p.upper())), default=0
        )
        if longest:
            fits.append((longest, listing.id))
    return [profile_id for _, profile_id in sorted(fits, reverse=True)]


def mentions_function(path: Path, code: int) -> bool:
    """Whether a profile file declares a Modbus function, without decoding the file."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
    return re.search(rf"^\[\[functions\]\]\s+code\s*=\s*{code}\b", text, re.MULTILINE) is not None


_PREFIXES = re.compile(r"^reference_prefixes\s*=\s*\[([^\]]*)\]", re.MULTILINE)


def _prefixes(path: Path) -> list[str]:
    try:
        match = _PREFIXES.search(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return []
    return re.findall(r'"([^"]+)"', match[1]) if match else []
