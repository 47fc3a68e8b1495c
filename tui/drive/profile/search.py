"""Search for parameters by the words of a technician."""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_left
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

from ..errors import ProfileError
from .library import packaged_folder, user_folder
from .profile import Profile, notations
from .schema import Parameter
from .search_file import Topic, Vocabulary, read_vocabulary

SHORTEST_BEGINNING = 3
"""Letters of a word from which its beginning finds a topic or a name."""

MOST_OPTIONAL_WORDS = 5
"""Words of which some may be omitted: each choice costs a search, in the thread of the keys."""

_WORD = re.compile(r"[a-z0-9+%]+")

Phrase = frozenset[str]
"""The words of a name, or of one spelling of a topic; of words that mean the same, the first."""
Score = tuple[int, int, int]
"""Kind of match, number of words too many, and rank in a topic; the lowest is best."""

EXACT, TOPIC, CODE, WORDS, BEGINNINGS, TEXT, INSIDE_CODE, VALUES = range(8)
"""Kinds of match: the code or the address; all words of a topic or name; the beginning of the
code; some words of a topic or name; beginnings of such words; a part of name, address and topics; a
part of the code; the group, or the name of a value."""


def plain_letters(text: str) -> str:
    """Return a text in small letters without accents: `Décélération` is `deceleration`."""
    if text.isascii():
        return text.casefold()
    split = unicodedata.normalize("NFKD", text.casefold().replace("\u0153", "oe"))
    return "".join(letter for letter in split if not unicodedata.combining(letter))


def search_words(text: str, skipped: Collection[str] = ()) -> tuple[str, ...]:
    """Return the words of a text without accents and plural endings, and without skipped ones."""
    words = _WORD.findall(plain_letters(text))
    kept = [word for word in words if word not in skipped] or words
    return tuple(_singular(word) for word in kept)


def _singular(word: str) -> str:
    plural = len(word) > 3 and word.endswith("s") and not word.endswith("ss")
    return word[:-1] if plural else word


class _Entry(NamedTuple):
    """The texts by which one parameter is found."""

    code: str
    exact: frozenset[str]
    """Spellings of its number and address."""
    text: str
    values: str


class ParameterSearch:
    """The texts of a family's parameters, prepared once for many searches."""

    def __init__(self, profile: Profile, vocabulary: Vocabulary) -> None:
        self._skipped = frozenset(vocabulary.skipped)
        groups = [
            [word for text in group for word in search_words(text)] for group in vocabulary.synonyms
        ]
        self._same = {word: group[0] for group in groups for word in group}
        self._names = {p.code: self._phrase(p.name) for p in profile.parameters}
        self._ranks: dict[Phrase, dict[str, int]] = {}
        """By phrase, the codes that it finds, with their rank."""
        for code, phrase in self._names.items():
            self._add(phrase, code, 0)
        joined: set[Phrase] = set()
        for topic in vocabulary.topics:
            phrases = {self._phrase(text) for text in topic.words}
            # words are often typed with nothing between them
            together = {frozenset(("".join(self._typed(text)),)) for text in topic.words}
            joined |= together - phrases
            for rank, code in enumerate(self._codes(profile, topic)):
                for phrase in phrases | together:
                    self._add(phrase, code, rank)
        self._phrases = list(self._ranks.items())
        self._places: dict[str, int] = {}
        """By word of a phrase, its places in the phrases as a number with a bit for each."""
        for place, phrase in enumerate(self._ranks):
            for word in phrase:
                self._places[word] = self._places.get(word, 0) | 1 << place
        self._known = {word: word for word in self._places} | self._same
        self._spelled = sorted(self._known)
        words: dict[str, set[str]] = {p.code: set() for p in profile.parameters}
        for phrase, ranks in self._ranks.items():
            for code in ranks if phrase not in joined else ():
                words[code] |= phrase
        self._entries = {p.code: _entry(profile, p, words[p.code]) for p in profile.parameters}

    def _typed(self, text: str) -> tuple[str, ...]:
        return search_words(text, self._skipped)

    def _phrase(self, text: str) -> Phrase:
        return frozenset(self._same.get(word, word) for word in self._typed(text))

    def _add(self, phrase: Phrase, code: str, rank: int) -> None:
        ranks = self._ranks.setdefault(phrase, {})
        ranks[code] = min(rank, ranks.get(code, rank))

    def _codes(self, profile: Profile, topic: Topic) -> list[str]:
        """Return the parameters of a topic, best first."""
        found = dict.fromkeys(topic.codes)
        quantities = (profile.quantity(quantity) for quantity in topic.quantities)
        found |= dict.fromkeys(p.code for p in quantities if p is not None)
        for name in topic.names:
            wanted = self._phrase(name)
            fits = [code for code, phrase in self._names.items() if wanted <= phrase]
            found |= dict.fromkeys(sorted(fits, key=lambda code: len(self._names[code])))
        return list(found)

    def scores(self, search: str) -> Mapping[str, Score]:
        """Return the codes that fit a search, each with its score; none for an empty search.

        If no parameter fits all words, return those whose name or topic fits most words, at least
        half of them.
        """
        raw = " ".join(search.casefold().split())
        if not raw:
            return {}
        words = search_words(search, self._skipped)
        if found := self._fitting(raw, words or (raw,)):
            return found
        found = {}
        most = len(words) // 2 if len(words) <= MOST_OPTIONAL_WORDS else 0
        for omitted in range(1, most + 1):
            for kept in combinations(words, len(words) - omitted):
                for code, score in self._best_phrases(kept).items():
                    found[code] = min(score, found.get(code, score))
            if found:
                break
        return found

    def _fitting(self, raw: str, words: Sequence[str]) -> dict[str, Score]:
        """Return the codes that fit all words."""
        best = self._best_phrases(words)
        found = {}
        for code, entry in self._entries.items():
            if (score := self._score(entry, best.get(code), raw, words)) is not None:
                found[code] = score
        return found

    def _best_phrases(self, words: Iterable[str]) -> Mapping[str, Score]:
        """Return, by code, the score of its best phrase that has all words or begins with them."""
        words = tuple(words)
        typed = frozenset(self._same.get(word, word) for word in words)
        found: dict[str, Score] = {}
        for place in self._places_of(words):
            phrase, ranks = self._phrases[place]
            kind = TOPIC if phrase == typed else WORDS if typed <= phrase else BEGINNINGS
            for code, rank in ranks.items():
                score = (kind, max(0, len(phrase) - len(typed)), rank)
                found[code] = min(score, found.get(code, score))
        return found

    def _places_of(self, words: Sequence[str]) -> Iterator[int]:
        """Yield the places of the phrases that have a word for each of these."""
        left = (1 << len(self._phrases)) - 1
        for word in words:
            fits = 0
            for meaning in self._meanings(word):
                fits |= self._places.get(meaning, 0)
            left &= fits
        while left:
            place = left.bit_length() - 1
            yield place
            left ^= 1 << place

    def _meanings(self, word: str) -> Phrase:
        """Return the words of phrases that a typed word means, or that it begins if long enough."""
        if len(word) < SHORTEST_BEGINNING:
            return frozenset((self._same.get(word, word),))
        first = at = bisect_left(self._spelled, word)
        while at < len(self._spelled) and self._spelled[at].startswith(word):
            at += 1
        return frozenset(self._known[other] for other in self._spelled[first:at])

    def _score(
        self, entry: _Entry, phrase: Score | None, raw: str, words: Sequence[str]
    ) -> Score | None:
        """Return how well a parameter fits, given the score of its best phrase."""
        if raw == entry.code:
            return EXACT, 0, 0
        if raw in entry.exact:
            return EXACT, 1, 0
        if phrase is not None and phrase[0] == TOPIC:
            return phrase
        if entry.code.startswith(raw):
            return CODE, 0, 0
        if phrase is not None:
            return phrase
        left = [w for w in words if w not in entry.text and self._same.get(w, w) not in entry.text]
        if not left:
            return TEXT, 0, 0
        if raw in entry.code:
            return INSIDE_CODE, 0, 0
        return (VALUES, 0, 0) if all(word in entry.values for word in left) else None


def _entry(profile: Profile, parameter: Parameter, words: Iterable[str]) -> _Entry:
    code, number, address = notations(parameter)
    exact = {number.casefold(), str(parameter.address), f"16#{parameter.address:04x}"}
    values = " ".join((parameter.group, *profile.names(parameter).values()))
    return _Entry(
        code.casefold(),
        frozenset(exact),
        plain_letters(" ".join((code, number, address, parameter.name, *sorted(words)))),
        plain_letters(values),
    )


@lru_cache(maxsize=8)
def parameter_search(profile: Profile) -> ParameterSearch:
    """Return the search of a profile; its files are read at the first call.

    A file of the user's own that cannot be used is skipped; `profiles --check` reports it.
    """
    try:
        vocabulary = read_vocabulary(profile.data, (user_folder(), packaged_folder()))
    except ProfileError:
        vocabulary = read_vocabulary(profile.data, (packaged_folder(),), strict=False)
    return ParameterSearch(profile, vocabulary)
