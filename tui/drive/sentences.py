"""Sentences with a count, one for a single thing, one for several or none; and a general one."""

from __future__ import annotations

from collections.abc import Sequence

MAY_START = "A run command that is still present may start the motor."
"""The effect of a reset, for help and for a drive whose command channel is not known."""


def counted(count: int, single: str, several: str, **values: object) -> str:
    """Return the sentence that fits a count, with `{count}` and other placeholders filled in."""
    return (single if count == 1 else several).format(count=count, **values)


def first_of(items: Sequence[str], most: int, separator: str = ", ") -> str:
    """Return a list of names, of which `most` are shown, with the number of the others."""
    shown, more = separator.join(items[:most]), len(items) - most
    return f"{shown} and {more} more" if more > 0 else shown


def without_stop(text: str) -> str:
    """Return a text without its full stop, so that more can follow it."""
    return text.removesuffix(".")


def sentence(text: str) -> str:
    """Return a text of a profile or a file with exactly one full stop at its end."""
    return f"{text.rstrip('.')}."


def capitalized(text: str) -> str:
    """Return a text of a profile with a capital first letter, to begin a row or a sentence."""
    return text[:1].upper() + text[1:]


def uncapitalized(text: str) -> str:
    """Return a text of a profile with a small first letter; an abbreviation keeps its capitals."""
    first, rest = text[:1], text[1:]
    return text if rest[:1].isupper() or not rest else first.lower() + rest


def all_of(names: Sequence[str]) -> str:
    """Return names as one part of a sentence, with `and` before the last."""
    *first, last = names or ("none",)
    return f"{', '.join(first)} and {last}" if first else last


def any_of(names: Sequence[str]) -> str:
    """Return names as one part of a sentence, with `or` before the last."""
    *first, last = names or ("none",)
    return f"{', '.join(first)} or {last}" if first else last
