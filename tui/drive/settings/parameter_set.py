"""A parameter set as text: one line per parameter, in the order of the profile, easy to compare.

It is TOML. A person may edit the `value` of a line after deleting its `raw`; if a line has both,
they must agree. Header and end state the number of parameters, so that a file that was cut short is
detected.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..errors import DriveError
from ..plain import escaped_toml
from ..profile.profile import Profile
from ..profile.schema import Parameter
from ..shown import scale_sources, shown

SET_FORMAT = 1
SET_HEADER = "set"
END_OF_SET = "end"
ABSENT = "absent"
_BARE = re.compile(r"[A-Za-z0-9_-]+")


class SetError(DriveError):
    """A parameter set cannot be used; the text names the file, the line and the fault."""


@dataclass(frozen=True, slots=True)
class SetHead:
    """Origin of a parameter set."""

    profile: str
    profile_version: str = ""
    family: str = ""
    time: str = ""
    """Local time with its zone, ISO 8601."""
    line: str = ""
    device: int = 0
    panel: str = ""
    """Version of the panel that wrote it."""
    identity: Mapping[str, str] = field(default_factory=dict)
    """Identity reported by the drive: vendor, reference, version, name."""


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """Raw values of one drive by code, with those that could not be read."""

    head: SetHead
    raws: Mapping[str, int]
    absent: Mapping[str, str] = field(default_factory=dict)
    """Codes without a value, and why."""
    unknown: Mapping[str, str] = field(default_factory=dict)
    """Codes in the file that the profile does not have, with their values as written."""
    lines: Mapping[str, int] = field(default_factory=dict)
    """Line of each code in its file."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """By code, the remark on a value that was edited by hand and rounded."""
    lossy: frozenset[str] = frozenset()
    """Codes of values, edited by hand, that rounding changes."""


def dump_set(profile: Profile, values: ParameterSet) -> str:
    """Return the text of a parameter set; the same values give the same text except for time and
    line."""
    head = values.head
    known = [p for p in profile.parameters if p.code in values.raws]
    lines = [
        "# Parameter set of a drive. To change a value by hand, edit `value` and delete `raw` in",
        "# that line. To leave a parameter of the drive unchanged, delete its line, and correct",
        "# `parameters` at the top and at the end.",
        "",
        f"[{SET_HEADER}]",
        f"format = {SET_FORMAT}",
        *(f"{key} = {escaped_toml(text)}" for key, text in _head_texts(head)),
        f"device = {head.device}",
        f"parameters = {len(known)}",
    ]
    if head.identity:
        lines += ["", "[identity]"]
        lines += [
            f"{_key(key)} = {escaped_toml(text)}" for key, text in sorted(head.identity.items())
        ]
    for group in profile.groups:
        members = [p for p in known if p.group == group]
        if members:
            lines += ["", f"[parameters.{_key(group)}]"]
            lines += [_line(profile, p, values) for p in members]
    if values.absent:
        lines += ["", f"[{ABSENT}]"]
        order = [p.code for p in profile.parameters if p.code in values.absent]
        lines += [f"{_key(code)} = {escaped_toml(values.absent[code])}" for code in order]
    return "\n".join([*lines, "", f"[{END_OF_SET}]", f"parameters = {len(known)}", ""])


def _head_texts(head: SetHead) -> list[tuple[str, str]]:
    return [
        ("panel", head.panel),
        ("profile", head.profile),
        ("profile_version", head.profile_version),
        ("family", head.family),
        ("time", head.time),
        ("line", head.line),
    ]


def _line(profile: Profile, parameter: Parameter, values: ParameterSet) -> str:
    raw = values.raws[parameter.code]
    value = shown(profile, parameter, raw, values.raws, lacking(profile, values.raws)).display
    return (
        f"{_key(parameter.code)} = {{ raw = {raw}, value = {escaped_toml(value)},"
        f" name = {escaped_toml(parameter.name)} }}"
    )


def lacking(profile: Profile, raws: Mapping[str, int]) -> frozenset[str]:
    """Return the scale sources without a value; by the set, the drive does not have them."""
    return frozenset(code for code in scale_sources(profile) if code not in raws)


def _key(text: str) -> str:
    return text if _BARE.fullmatch(text) else escaped_toml(text)
