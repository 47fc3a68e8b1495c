"""Match of a block's word with the parameter read directly."""

from __future__ import annotations

from enum import StrEnum


class SlotMatch(StrEnum):
    """Match of a slot's value with the parameter read directly."""

    SAME = "same"
    MOVING = "moving"
    DIFFERS = "differs"
    CHANGED = "changed meanwhile"
    NONE = "no value"
    UNUSED = "unused"
    UNREAD = "not compared"
