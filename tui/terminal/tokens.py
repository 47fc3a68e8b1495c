"""Tokens from the characters of a terminal."""

from __future__ import annotations

from typing import NamedTuple


class KeyToken(NamedTuple):
    """A key: its name in Textual, what it types, when its first and its last character was read."""

    name: str
    character: str | None
    began: float
    at: float
    mark: object = None
    """Whatever was given with the read in which it began."""


class Paste(NamedTuple):
    """A text that was pasted, with the brackets that terminals put around it."""

    text: str
    at: float


class Report(NamedTuple):
    """Something that the terminal says of itself and Textual wants to hear."""

    text: str


Token = KeyToken | Paste | Report
