"""Words that find parameters: topics of all families, and their codes in one family."""

from typing import Annotated

from .base import Identifier, Quantity, Table, about


class SearchTopic(Table, frozen=True, kw_only=True):
    """A topic of the trade, for every family: its words, and the parameters that they find."""

    id: Identifier
    words: Annotated[
        list[str],
        about("Words and phrases for it, in any language; accents and case do not matter."),
    ]
    quantities: Annotated[list[Quantity], about("Quantities of its parameters, best first.")] = []
    names: Annotated[
        list[str],
        about("Words of names of further parameters, best first; all words must be in the name."),
    ] = []


class SearchWords(Table, frozen=True, kw_only=True):
    """The file of the topics that all families share."""

    skipped: Annotated[list[str], about("Words that describe no parameter, such as `of`.")] = []
    synonyms: Annotated[
        list[list[str]],
        about("Single words that mean the same, in names and in searches."),
    ] = []
    topics: list[SearchTopic]


class FamilyTopic(Table, frozen=True, kw_only=True):
    """A topic in one family."""

    id: Annotated[Identifier, about("A shared topic, or a topic of its own with `words`.")]
    codes: Annotated[
        list[str],
        about("Its parameters in this family, best first; those of the shared topic follow."),
    ] = []
    words: Annotated[list[str], about("Further words for it.")] = []


class FamilySearch(Table, frozen=True, kw_only=True):
    """The file of the topics of one family."""

    same_as: Annotated[
        str,
        about(
            "Id of a profile whose topics also apply; codes that this profile lacks are skipped."
        ),
    ] = ""
    topics: list[FamilyTopic] = []
