"""Files of words that find parameters, read at the first search.

They are separate from the profile, so that a drive is displayed without loading them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ..errors import ProfileError
from .help_file import decode_tables, line_of
from .schema import FamilySearch, FamilyTopic, ProfileData, Quantity, SearchWords
from .shared_rows import source_text

SEARCH_FOLDER = "search"
SHARED = "words.toml"


class Topic(NamedTuple):
    """A topic in one family."""

    words: tuple[str, ...]
    codes: tuple[str, ...] = ()
    """Parameters of the family, best first."""
    quantities: tuple[Quantity, ...] = ()
    names: tuple[str, ...] = ()


class Vocabulary(NamedTuple):
    """The words of a family."""

    topics: Sequence[Topic] = ()
    synonyms: Sequence[Sequence[str]] = ()
    """Groups of words that mean the same."""
    skipped: Sequence[str] = ()
    """Words that describe no parameter, such as `of`."""


def read_vocabulary(
    data: ProfileData, folders: Sequence[Path], *, strict: bool = True
) -> Vocabulary:
    """Return the words of a family: topics of all families with its own codes, then its own.

    `folders` hold profiles; files are sought in their folder `search`, the first found counts.
    The shared topics are in the last folder. Raises ProfileError with each fault, file and line.
    From a file that is not beside the profile (the first folder), codes that do not exist are
    skipped: it belongs to another edition. If not `strict`, they are skipped from every file.
    """
    shared = decode_tables(source_text(folders[-1] / SEARCH_FOLDER / SHARED), SearchWords)
    known = {parameter.code for parameter in data.parameters}
    shared_ids = {topic.id for topic in shared.topics}
    own = _family_topics(data.profile.id, folders, shared_ids, known, strict=strict)
    found = []
    for topic in shared.topics:
        words, codes = _merged(own, topic.id, known)
        found.append(
            Topic((*topic.words, *words), codes, tuple(topic.quantities), tuple(topic.names))
        )
    others = dict.fromkeys(topic.id for topic in own if topic.id not in shared_ids)
    found += [Topic(*_merged(own, topic_id, known)) for topic_id in others]
    return Vocabulary(found, shared.synonyms, shared.skipped)


def _merged(
    own: Sequence[FamilyTopic], topic_id: str, known: Collection[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the words and the existing codes of a family's rows of a topic."""
    rows = [topic for topic in own if topic.id == topic_id]
    codes = dict.fromkeys(code for row in rows for code in row.codes if code in known)
    return tuple(word for row in rows for word in row.words), tuple(codes)


def _family_topics(
    profile_id: str,
    folders: Sequence[Path],
    shared: Collection[str],
    known: Collection[str],
    *,
    strict: bool,
) -> list[FamilyTopic]:
    """Return the rows of a family's file, then those of the family that it resembles."""
    path = _found(f"{profile_id}.toml", folders)
    if path is None:
        return []
    source = source_text(path)
    family = decode_tables(source, FamilySearch)
    findings = list(_findings(family, shared, known))
    if strict and findings and path.parent.parent == folders[0]:
        lines = [
            f"{path}:{line_of(source, ('topics', index))}: {fault}" for index, fault in findings
        ]
        raise ProfileError("\n".join(lines))
    rows = list(family.topics)
    if family.same_as:
        other = _found(f"{family.same_as}.toml", folders)
        if other is None:
            line = line_of(source, ("same_as",))
            raise ProfileError(f"{path}:{line}: same_as: there is no file {family.same_as}.toml.")
        rows += decode_tables(source_text(other), FamilySearch).topics
    return rows


def _found(name: str, folders: Sequence[Path]) -> Path | None:
    return next(
        (f / SEARCH_FOLDER / name for f in folders if (f / SEARCH_FOLDER / name).is_file()), None
    )


def _findings(
    family: FamilySearch, shared: Collection[str], known: Collection[str]
) -> Iterator[tuple[int, str]]:
    """Rows of a family's file that do not fit, each with what is wrong."""
    seen: set[str] = set()
    for index, topic in enumerate(family.topics):
        if topic.id in seen:
            yield index, f"topic {topic.id}: there are two."
        seen.add(topic.id)
        if topic.id not in shared and not topic.words:
            yield index, f"topic {topic.id}: it is not in {SHARED} and has no words."
        for code in topic.codes:
            if code not in known:
                yield index, f"topic {topic.id}: there is no parameter {code!r}."
