"""An indirect block or a table of the communication scanner."""

from __future__ import annotations

from typing import Literal

from .base import Effective, Identifier, RawWord, ReadCount, Table, WordAddress


class BlockChoice(Table, frozen=True, kw_only=True):
    """A raw selector value of an indirect block and the parameter it stands for."""

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
    """Parameters that select the contents of each place, in order."""
    values: list[str] = []
    """Parameters that carry the values, where they are parameters of their own."""
    selects_by: Literal["choice", "address"]
    choices: list[BlockChoice] = []
    fixed_start: bool = False
    """True where a read must begin at `address`; else any part of it may be read."""
    write_when: Literal["any", "stopped"] = "any"
    effective: Effective = "at-once"
    note: str = ""
    source: str = ""
