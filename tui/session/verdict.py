"""How a word that came through a block compares with the parameter read directly."""

from __future__ import annotations

from enum import StrEnum

from tui.drive.schema import Parameter

from .readings import Reading


class Verdict(StrEnum):
    """How what a slot brings compares with the parameter read directly."""

    SAME = "same"
    MOVING = "moving"
    DIFFERS = "differs"
    CHANGED = "changed meanwhile"
    NONE = "no value"
    UNUSED = "unused"
    UNREAD = "not compared"


def compare(
    parameter: Parameter, word: int, before: Reading | None, after: Reading | None
) -> Verdict:
    """How a raw value compares with direct readings just before and just after it."""
    first = before.raw if before else None
    second = after.raw if after else None
    if first is None or second is None:
        return Verdict.UNREAD
    if first == second:
        return Verdict.SAME if word == first else Verdict.DIFFERS
    if parameter.bits:
        # between two words of bits: every bit as in one of them
        return Verdict.DIFFERS if (word ^ first) & (word ^ second) & 0xFFFF else Verdict.MOVING
    # a value that trembles may have been beyond both: as far again as it went between them
    margin = abs(second - first)
    within = min(first, second) - margin <= word <= max(first, second) + margin
    return Verdict.MOVING if within else Verdict.DIFFERS
