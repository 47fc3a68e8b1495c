"""An indirect block or a table of the communication scanner."""

from __future__ import annotations

from typing import Literal

from .base import Effective, Identifier, RawWord, ReadCount, Table, WordAddress


class BlockChoice(Table, frozen=True, kw_only=True):
    """Raw selector value of an indirect block and its parameter."""

    raw: RawWord
    parameter: str


class Block(Table, frozen=True, kw_only=True):
    """An indirect block or a table of the communication scanner."""

    id: Identifier
    name: str
    direction: Literal["read", "write"]
    address: WordAddress
    min_words: ReadCount = 1
    max_words: ReadCount
    slots: list[str]
    """Parameters that select the content of each slot, in order."""
    values: list[str] = []
    """Parameters that carry the values, if they are separate parameters."""
    selects_by: Literal["choice", "address"]
    choices: list[BlockChoice] = []
    fixed_start: bool = False
    """True if a read must begin at `address`; otherwise any part can be read."""
    write_when: Literal["any", "stopped"] = "any"
    effective: Effective = "at-once"
    note: str = ""
    source: str = ""
