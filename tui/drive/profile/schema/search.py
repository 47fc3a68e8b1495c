"""Words that find parameters: topics of all families, and their codes in one family."""

from __future__ import annotations

from .base import Identifier, Table
from .parameter import Quantity


class SearchTopic(Table, frozen=True, kw_only=True):
    """A topic of the trade, for every family: its words, and the parameters that they find."""

    id: Identifier
    words: list[str]
    """Words and phrases for it, in any language; accents and case do not matter."""
    quantities: list[Quantity] = []
    """Quantities of its parameters, best first."""
    names: list[str] = []
    """Words of names of further parameters, best first; all words must be in the name."""


class SearchWords(Table, frozen=True, kw_only=True):
    """The file of the topics that all families share."""

    skipped: list[str] = []
    """Words that describe no parameter, such as `of`."""
    synonyms: list[list[str]] = []
    """Single words that mean the same, in names and in searches."""
    topics: list[SearchTopic]


class FamilyTopic(Table, frozen=True, kw_only=True):
    """A topic in one family."""

    id: Identifier
    """A shared topic, or a topic of its own with `words`."""
    codes: list[str] = []
    """Its parameters in this family, best first; those of the shared topic follow."""
    words: list[str] = []
    """Further words for it."""


class FamilySearch(Table, frozen=True, kw_only=True):
    """The file of the topics of one family."""

    same_as: str = ""
    """Id of a profile whose topics also apply; codes that this profile lacks are skipped."""
    topics: list[FamilyTopic] = []
