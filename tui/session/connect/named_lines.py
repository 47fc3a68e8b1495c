"""Lines that a person has named in the settings file, with the drive that is meant on each.

    [lines]
    pump = "serial:/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0,19200,8E1"

    [lines.fan]
    line = "tcp:192.168.0.10"
    device = 5
    profile = "ID"

The file is read when a name is looked for, and never for a LINE that is written out. What is wrong
with one name hinders no other.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from tui.bus.errors import LinkSyntaxError
from tui.drive.profile.library import user_folder
from tui.drive.sentences import first_of
from tui.drive.small_file import read_small_text

if TYPE_CHECKING:
    from tui.drive.profile.toml_lines import TomlPath

LONGEST_SETTINGS = 200_000
"""Bytes of a file that may be the settings."""
LINES_TABLE = "lines"
RECORD_TABLE, RECORD_KEY = "record", "on"
REPORT_TABLE = "report"
SETTINGS_TABLES = LINES_TABLE, RECORD_TABLE, REPORT_TABLE
LONGEST_NAME = 60
MOST_NAMED, NAMES_LISTED = 200, 3
"""Names that are read, and names of the others that a message lists."""
_NAME = re.compile(r"(?!COM\d+$)[A-Za-z][A-Za-z0-9_-]{0,31}", re.IGNORECASE)
_TAKEN = frozenset({"factory"})
"""Words with another meaning at the position of a LINE."""
_KEYS = ("line", "device", "profile")
_DEVICES = range(1, 248)
NO_LINES: Mapping[str, NamedLine] = MappingProxyType({})
NO_PLACES: Mapping[str, str] = MappingProxyType({})


class SettingsError(LinkSyntaxError):
    """Error in the settings file, with file, line and key."""


class NamedLine(NamedTuple):
    """Named line; `device` and `profile` of its drive, if given."""

    name: str
    line: str
    device: int | None = None
    profile: str | None = None


class ReportNames(NamedTuple):
    """Names on the page of a report for the customer; empty if the settings do not have them."""

    company: str = ""
    name: str = ""
    customer: str = ""
    customer_name: str = ""


class LineSettings(NamedTuple):
    """Lines in the settings file, and its errors."""

    path: Path
    lines: Mapping[str, NamedLine] = NO_LINES
    """By lowercase name, in the order of the file."""
    faults: tuple[str, ...] = ()
    """File, line, key and fault of each error; the lines concerned are omitted from `lines`."""
    text: str = ""
    """Content of the file; empty if it cannot be read."""
    places: Mapping[str, str] = NO_PLACES
    """File, line and key by name."""
    record: bool = True
    """False if `on = false` in the table of the record."""
    names: ReportNames = ReportNames()
    """Table of the report."""


def settings_file() -> Path:
    """The settings file in the configuration folder, next to the user's own profiles."""
    return user_folder().parent / "settings.toml"


def named_lines() -> Mapping[str, NamedLine]:
    """The named lines by lowercase name; raises nothing."""
    return line_settings().lines


def line_settings() -> LineSettings:
    """Return the lines of the settings file, read again if it has changed; raises nothing."""
    path = settings_file()
    try:
        reported = os.stat(path)
    except OSError:
        return LineSettings(path)
    return _read(path, (reported.st_mtime_ns, reported.st_size, reported.st_ino))


def is_name(text: str) -> bool:
    """Return True if a text is a valid name of a line."""
    return _NAME.fullmatch(text) is not None and text.casefold() not in _TAKEN


def line_named(text: str) -> NamedLine | None:
    """The line of a name; None if the text is a LINE or an unknown name.

    Raises SettingsError if the name is in an invalid part of the file.
    """
    if not is_name(text):
        return None
    settings = line_settings()
    if found := settings.lines.get(text.casefold()):
        return found
    if not settings.faults or os.path.exists(text):
        return None
    raise SettingsError("\n".join((*settings.faults, f"So it is not known which line {text} is.")))


def line_to_stop(text: str) -> NamedLine | None:
    """The line of a name, even if the rest of the file is invalid, so that a stop is sent.

    Raises SettingsError if its line or its drive is ambiguous.
    """
    try:
        return line_named(text)
    except SettingsError:
        if found := _salvaged(line_settings().text, text):
            return found
        raise


def profile_named(line_key_of: str, device: int) -> str | None:
    """The profile in the settings for the drive at an address of a line, by the line's key."""
    from .line_key import line_key

    for line in named_lines().values():
        if line.profile and line.device in (None, device) and line_key(line.line) == line_key_of:
            return line.profile
    return None


def profiles_of_line(line_key_of: str) -> dict[int, str]:
    """The profiles in the settings for the drives of a line, by device."""
    from .line_key import line_key

    return {
        line.device: line.profile
        for line in named_lines().values()
        if line.profile and line.device is not None and line_key(line.line) == line_key_of
    }


@lru_cache(maxsize=2)
def _read(path: Path, _stamp: tuple[int, int, int]) -> LineSettings:
    try:
        text = read_small_text(path, LONGEST_SETTINGS)
    except UnicodeDecodeError as error:
        return LineSettings(path, faults=(f"{path}: byte {error.start} is not UTF-8 text.",))
    except OSError as error:
        return LineSettings(path, faults=(f"{path}: cannot be read: {error.strerror}.",))
    import tomli

    try:
        tables = tomli.loads(text)
    except tomli.TOMLDecodeError as error:
        line = getattr(error, "lineno", 1)
        return LineSettings(path, faults=(f"{path}:{line}: not valid TOML: {error}.",), text=text)
    except RecursionError:
        return LineSettings(path, faults=(f"{path}: it is nested too deep.",), text=text)
    from tui.drive.profile.toml_lines import toml_lines

    places = toml_lines(text)
    found: dict[str, NamedLine] = {}
    at: dict[str, str] = {}
    faults: list[tuple[TomlPath, str]] = []
    names = ReportNames()
    for key, value in tables.items():
        if key == RECORD_TABLE:
            faults += _record_faults(value)
            continue
        if key == REPORT_TABLE:
            names, wrong = _report_names(value)
            faults += wrong
            continue
        if key != LINES_TABLE or not isinstance(value, dict):
            faults.append(
                (
                    (key,),
                    f"only a table {', '.join(f'[{t}]' for t in SETTINGS_TABLES)} is known here",
                )
            )
            continue
        if unread := list(value)[MOST_NAMED:]:
            names_left = first_of([*map(str, unread)], NAMES_LISTED)
            faults.append(((key,), f"only {MOST_NAMED} names are read, not {names_left}"))
        for name, reported in list(value.items())[:MOST_NAMED]:
            if fault := next(_faults(name, reported, found), None):
                faults.append(fault)
            else:
                found[name.casefold()] = _named(name, reported)
                at[name.casefold()] = f"{path}:{places.get((key, name), 1)}: {key}.{name}"
    fault_texts = (
        f"{path}:{places.get(key, 1)}: {'.'.join(map(str, key))}: {fault}." for key, fault in faults
    )
    return LineSettings(path, found, tuple(fault_texts), text, at, _is_recorded(tables), names)


def _is_recorded(tables: Mapping[str, Any]) -> bool:
    table = tables.get(RECORD_TABLE)
    return not isinstance(table, dict) or table.get(RECORD_KEY) is not False


def _record_faults(table: object) -> Iterator[tuple[TomlPath, str]]:
    """Yield the errors of the table that turns the record off."""
    if not isinstance(table, dict):
        yield (RECORD_TABLE,), f"expected a table with {RECORD_KEY}"
        return
    for key, value in table.items():
        if key != RECORD_KEY:
            yield (RECORD_TABLE, key), f"only {RECORD_KEY} is known here"
        elif not isinstance(value, bool):
            yield (RECORD_TABLE, key), "expected true or false"


def _report_names(table: object) -> tuple[ReportNames, list[tuple[TomlPath, str]]]:
    """Return the names in the table of the report that are valid, and the errors of the others."""
    keys = ReportNames._fields
    if not isinstance(table, dict):
        return ReportNames(), [((REPORT_TABLE,), f"expected a table with {', '.join(keys)}")]
    found: dict[str, str] = {}
    faults: list[tuple[TomlPath, str]] = []
    for key, value in table.items():
        if key not in keys:
            faults.append(((REPORT_TABLE, key), f"only {', '.join(keys)} are known here"))
        elif not isinstance(value, str) or len(value) > LONGEST_NAME:
            text = f"expected a text of {LONGEST_NAME} characters at most"
            faults.append(((REPORT_TABLE, key), text))
        else:
            found[key] = value
    return ReportNames(**found), faults


NAME_FORM = (
    "a name is a letter with up to 31 letters, digits, - and _, but not `factory` or a COM port"
)


def _faults(
    name: str, reported: object, others: Mapping[str, NamedLine]
) -> Iterator[tuple[TomlPath, str]]:
    """Yield the errors of one name."""
    here: TomlPath = (LINES_TABLE, name)
    if not is_name(name):
        yield here, NAME_FORM
    elif name.casefold() in others:
        known = others[name.casefold()].name
        yield here, f"{known} has this name already; capital letters do not distinguish names"
    row = here
    if isinstance(reported, dict):
        row = (*here, "line") if "line" in reported else here
    elif isinstance(reported, str):
        reported = {"line": reported}
    else:
        yield here, f"expected a LINE in quotes, or a table with {', '.join(_KEYS)}"
        return
    for key in reported:
        if key not in _KEYS:
            yield (*here, key), f"only {', '.join(_KEYS)} are known here"
    line = reported.get("line")
    if not isinstance(line, str) or not line.strip():
        yield row, "expected a LINE in quotes"
    elif is_name(line.strip()):
        yield row, f'{line.strip()!r} is not a LINE. Use for example "tcp:192.168.0.10"'
    device, profile = reported.get("device"), reported.get("profile")
    if "device" in reported and (type(device) is not int or device not in _DEVICES):
        yield (*here, "device"), f"expected an address from 1 to 247, not {_toml(device)}"
    if "profile" in reported and (not isinstance(profile, str) or not profile.strip()):
        yield (*here, "profile"), "expected the id of a profile in quotes"


def _toml(value: object) -> str:
    """Return a value as the file has it."""
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _named(name: str, reported: Any) -> NamedLine:
    reported = {"line": reported} if isinstance(reported, str) else reported
    profile = reported.get("profile")
    return NamedLine(
        name,
        reported["line"].strip(),
        reported.get("device"),
        profile.strip().lower() if profile else None,
    )


_PAIR = re.compile(r"""["']?([\w-]+)["']?\s*=\s*(?:"([^"]*)"|'([^']*)'|(\d+))""")
_HEAD = re.compile(r"""\s*\[\s*(?:lines\s*\.\s*)?["']?([\w-]+)["']?\s*\]""")


def _salvaged(text: str, name: str) -> NamedLine | None:
    """The line of a name, recovered from an invalid file by its lines of text.

    Raises SettingsError if the line is clear and its address is not.
    """
    wanted, section = name.casefold(), ""
    parts: dict[str, str] = {}
    own: list[str] = []
    for row in text.splitlines():
        if head := _HEAD.match(row):
            section = head[1].casefold()
            continue
        key, sign, value = row.partition("=")
        key = key.strip().removeprefix(f"{LINES_TABLE}.").strip("\"' ").casefold()
        if section == wanted and sign:
            own.append(row)
        elif key == wanted and sign and section in ("", LINES_TABLE):
            own.append(value if "{" in value else f"line ={value}")
    for row in own:
        parts |= {f[1]: f[2] or f[3] or f[4] or "" for f in _PAIR.finditer(row)}
    if not parts.get("line", "").strip():
        return None
    found = NamedLine(name, parts["line"].strip(), profile=parts.get("profile") or None)
    if not any("device" in row for row in own):
        return found
    if not parts.get("device", "").isdecimal() or int(parts["device"]) not in _DEVICES:
        raise SettingsError(
            f"{settings_file()} is not valid, and the address of {name} cannot be read from it."
            f" Run: drivepanel stop {shlex.quote(found.line)} -d ADDRESS"
        )
    return found._replace(device=int(parts["device"]))
