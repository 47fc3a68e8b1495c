"""How a word that came through a block compares with the parameter read directly."""

from __future__ import annotations

from enum import StrEnum


class SlotMatch(StrEnum):
    """How what a slot brings compares with the parameter read directly."""

    SAME = "same"
    MOVING = "moving"
    DIFFERS = "differs"
    CHANGED = "changed meanwhile"
    NONE = "no value"
    UNUSED = "unused"
    UNREAD = "not compared"
