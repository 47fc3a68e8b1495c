"""Active command and reference channels of a drive, from its channel words."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from .profile.profile import Profile
from .profile.schema import ChannelRow, Parameter, When
from .values import set_bits


@dataclass(frozen=True, slots=True)
class Channel:
    """The active command or reference channel."""

    text: str
    """Name of the channel for a person; empty if it is not known."""
    by_line: bool | None
    """True if it is Modbus; None if that is not known."""
    parameter: Parameter | None = None
    """The word that shows the channel; if it is unknown, the deciding word that was not read."""
    is_several: bool = False
    """True if another word applies under other conditions."""


UNKNOWN_CHANNEL = Channel("", None)
"""Result if no row of the profile applies."""


def command_channel(profile: Profile, raws: Mapping[str, int]) -> Channel | None:
    """Return the commanding channel; None if the profile has no words for it."""
    rows = profile.data.channels.command
    return _in_force(profile, rows, raws) if rows else None


def reference_channel(profile: Profile, raws: Mapping[str, int]) -> Channel | None:
    """Return the reference channel; None if the profile has no words for it."""
    rows = profile.data.channels.reference
    return _in_force(profile, rows, raws) if rows else None


def channel_codes(profile: Profile) -> list[str]:
    """Return the codes of all words that show or switch the active channels."""
    channels = profile.data.channels
    rows = [*channels.command, *channels.reference]
    reported = [(row.parameter, row.when) for row in rows]
    reported += [(switch.parameter, switch.when) for switch in channels.switches]
    codes = [code for own, when in reported for code in (*(item.parameter for item in when), own)]
    return list(dict.fromkeys(codes))


def switch_texts(
    profile: Profile, raws: Mapping[str, int], without: Collection[str] = ()
) -> list[str]:
    """Return sentences on the causes and the effects of a channel change.

    `without` are parameters that are shown in another way.
    """
    found = []
    for switch in profile.data.channels.switches:
        if switch.parameter in without:
            continue
        raw = raws.get(switch.parameter)
        if raw is None or raw in switch.fixed or not all(w.holds(raws) for w in switch.when):
            continue
        parameter = profile[switch.parameter]
        value = profile.names(parameter).get(raw, str(raw))
        found.append(f"{parameter.code} is {value}: {switch.does}.")
    return found


def _in_force(profile: Profile, rows: Sequence[ChannelRow], raws: Mapping[str, int]) -> Channel:
    """Return the channel of the first row that applies; unknown if an earlier word is missing."""
    for row in rows:
        unread = undecided(row.when, raws)
        if unread == "":
            continue
        code = unread or (row.parameter if row.parameter not in raws else "")
        if code:
            return Channel("", None, profile[code], len(rows) > 1)
        value = (raws[row.parameter] & row.mask) >> row.shift
        text = _text(profile, row, raws[row.parameter], value)
        return Channel(text, value in row.line, profile[row.parameter], len(rows) > 1)
    return UNKNOWN_CHANNEL


def undecided(conditions: Sequence[When], raws: Mapping[str, int]) -> str | None:
    """Return the first unread word that decides; None if all conditions hold, "" if one fails."""
    verdicts = [(when.parameter, when.holds(raws)) for when in conditions]
    if any(holds is False for _, holds in verdicts):
        return ""
    return next((code for code, holds in verdicts if holds is None), None)


def _text(profile: Profile, row: ChannelRow, raw: int, value: int) -> str:
    parameter = profile[row.parameter]
    if (name := row.names.get(str(value))) is not None:
        return name
    if parameter.bits and not row.names:
        return ", ".join(bit.name for bit in set_bits(parameter.bits, raw)) or "none"
    return profile.names(parameter).get(value, f"{parameter.code} = {value}")
