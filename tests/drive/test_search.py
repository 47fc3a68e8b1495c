"""Search by the words of a technician: the first results, in every family."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
import pytest
import tomli

from tests.session.fakes import profile_of
from tests.sweeps import kept
from tui.drive.errors import ProfileError
from tui.drive.profile import json_schema, library
from tui.drive.profile.schema import FamilySearch, FamilyTopic, SearchTopic, SearchWords
from tui.drive.profile.search import (
    ParameterSearch,
    Score,
    parameter_search,
    plain_letters,
    search_words,
)
from tui.drive.profile.search_file import Vocabulary, read_vocabulary
from tui.drive.settings.selection import FilterContext, rows

FOLDER = library.packaged_folder() / "search"
SEARCHES: Mapping[str, Any] = tomli.loads(
    Path(__file__).with_name("searches.toml").read_text("utf-8")
)
IN_ORDER: list[str] = SEARCHES["in_order"]
FAMILIES = sorted(SEARCHES.keys() - {"in_order"})
TOP, REQUIRED = 3, 1.0


def found(family: str, search: str) -> list[str]:
    return rows(FilterContext(library.load(family)), "all", search)


def searches() -> Iterator[tuple[str, str, list[str]]]:
    for family in FAMILIES:
        for search, codes in SEARCHES[family]:
            yield family, search, codes.split()


def succeeds(search: str, wanted: list[str], shown: list[str]) -> bool:
    if search in IN_ORDER:
        return shown[: len(wanted)] == wanted
    return set(wanted) <= set(shown[: max(TOP, len(wanted))])


def test_searches_of_technicians_show_their_parameters_first() -> None:
    failed = [
        f"{family}: {search!r} shows {shown[:TOP]} instead of {wanted}"
        for family, search, wanted in searches()
        if not succeeds(search, wanted, shown := found(family, search))
    ]
    count = sum(1 for _ in searches())
    assert count >= 150
    assert len(failed) <= (1 - REQUIRED) * count, "\n".join(failed)


def test_searches_name_existing_parameters_of_all_families() -> None:
    assert sorted(listing.id for listing in library.listings()) == FAMILIES
    for family, search, wanted in searches():
        assert [c for c in wanted if library.load(family).get(c) is None] == [], (family, search)


@pytest.mark.parametrize("family", kept(FAMILIES, *(f for f in FAMILIES if f != "atv71")))
def test_exact_code_is_first(family: str) -> None:
    profile = library.load(family)
    search = parameter_search(profile)
    for parameter in profile.parameters:
        for typed in (parameter.code, f" {parameter.code.swapcase()} "):
            scores = search.scores(typed)
            assert min(scores, key=lambda code: scores[code]) == parameter.code, typed


def test_ramp_shows_acceleration_then_deceleration() -> None:
    for family in FAMILIES:
        profile = library.load(family)
        ramps = [profile.quantity("acceleration"), profile.quantity("deceleration")]
        codes = [p.code for p in ramps if p is not None] or ["2.11", "2.21"]
        for word in ("ramp", "RAMPE", "ramps"):
            assert found(family, word)[:2] == codes, (family, word)


def test_accents_case_plural_and_order_do_not_matter() -> None:
    assert plain_letters("Décélération Œ") == "deceleration oe"
    assert search_words("Temps d'Accélérations", {"d"}) == ("temp", "acceleration")
    assert search_words("loss of the", {"of", "the"}) == ("loss",)
    assert search_words("of", {"of"}) == ("of",)
    spellings = ("temps d'accélération", "TEMPS D'ACCELERATION", "acceleration temps")
    assert {tuple(found("atv31", text)[:2]) for text in spellings} == {("ACC", "AC2")}


def test_names_are_found_by_search_words_either_language() -> None:
    assert found("powerdrive", "consigne atteinte")[0] == "10.06"
    assert found("atv31", "seuil de fréquence")[0] == "Ftd"


def test_words_of_a_topic_are_found_without_a_space() -> None:
    assert found("atv71", "topspeed")[0] == "HSP"
    assert found("atv71", "top speed") == found("atv71", "speed top")
    assert found("atv21", "flyingrestart")[0] == "F301"


def test_beginning_of_a_word_finds_it_while_it_is_typed() -> None:
    for typed in ("watc", "watchd", "watchdo"):
        assert found("atv71", typed)[0] == "TTO"
    # the beginning of a code is more than that of a word
    assert found("atv71", "be")[:2] == ["BEN", "BECD"]


def test_too_many_words_show_what_fits_most_of_them() -> None:
    assert found("atv21", "motor pole count")[0] == "F856"
    assert found("atv71", "zzz") == []
    assert found("atv71", "zzz yyy xxx") == []


def test_long_text_is_searched_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    search = parameter_search(library.load("varmeca"))
    searched: list[object] = []
    best_phrases = search._best_phrases

    def counted(words: Iterable[str]) -> Mapping[str, Score]:
        searched.append(words)
        return best_phrases(words)

    monkeypatch.setattr(search, "_best_phrases", counted)
    assert search.scores("zz " * 400) == {}
    assert len(searched) == 1
    assert search.scores("zz yy xx ww vv") == {}
    assert len(searched) < 20


def test_number_and_address_find_their_parameter() -> None:
    for typed in ("W9001", "9001", "16#2329"):
        assert found("atv71", typed)[0] == "ACC"


def test_filter_holds_for_a_search() -> None:
    facts = FilterContext(library.load("atv71"), favorites={"DEC"})
    assert rows(facts, "favorites", "ramp") == ["DEC"]


PUMP = [
    {"code": "P1", "name": "Rise", "quantity": "acceleration"},
    {"code": "P2", "name": "Fall", "quantity": "deceleration"},
    {"code": "P3", "name": "Auto-tuning"},
    {"code": "P4", "name": "Upper pressure"},
]


def own_profile() -> Any:
    """A profile of another make."""
    base = {"number": "1", "address": 1, "access": "rw", "group": "A", "source": "x 1"}
    parameters = [
        {**base, **row, "number": f"{at}", "address": at, "confidence": "manual"}
        for at, row in enumerate(PUMP, start=1)
    ]
    return profile_of(parameters=parameters)


def test_profile_of_another_make_has_the_shared_words() -> None:
    profile = own_profile()
    search = ParameterSearch(profile, read_vocabulary(profile.data, (FOLDER.parent,)))
    scores = search.scores("ramp")
    assert sorted(scores, key=lambda code: scores[code]) == ["P1", "P2"]
    assert list(search.scores("autoréglage")) == ["P3"]


def own_folder(folder: Path, text: str) -> tuple[Path, Path]:
    """Folders of profiles; the first has its own words for the profile."""
    (folder / "search").mkdir()
    path = folder / "search" / f"{own_profile().id}.toml"
    path.write_text(text, encoding="utf-8")
    return folder, FOLDER.parent


def test_own_file_adds_codes_words_and_topics(tmp_path: Path) -> None:
    text = (
        '[[topics]]\nid = "ramp"\ncodes = ["P2"]\nwords = ["slope"]\n'
        '[[topics]]\nid = "pressure-limit"\nwords = ["burst"]\ncodes = ["P4"]\n'
    )
    profile = own_profile()
    search = ParameterSearch(profile, read_vocabulary(profile.data, own_folder(tmp_path, text)))
    for typed in ("ramp", "slope"):
        scores = search.scores(typed)
        assert sorted(scores, key=lambda code: scores[code]) == ["P2", "P1"]
    assert list(search.scores("burst")) == ["P4"]


BROKEN = {
    "no such code": ('[[topics]]\nid = "ramp"\ncodes = ["P9"]\n', "no parameter 'P9'"),
    "no such topic": ('[[topics]]\nid = "rump"\ncodes = ["P1"]\n', "is not in words.toml"),
    "two of a topic": ('[[topics]]\nid = "ramp"\n' * 2, "there are two"),
    "no such family": ('same_as = "none"\n', "no file none.toml"),
    "unknown key": ('[[topics]]\nid = "ramp"\ncode = "P1"\n', "code"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_error_in_a_file_of_words_is_reported_with_its_line(case: str, tmp_path: Path) -> None:
    text, output = BROKEN[case]
    with pytest.raises(ProfileError, match=rf"\.toml:\d+: .*{output}"):
        read_vocabulary(own_profile().data, own_folder(tmp_path, text))


def test_check_reports_words_that_do_not_fit_and_search_works_anyway(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "profiles"
    folder.mkdir()
    for name in ("atv312.toml", "atv31-312.rows"):
        text = (FOLDER.parent / name).read_text("utf-8")
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "search").mkdir()
    text = '[[topics]]\nid = "ramp"\ncodes = ["NONE"]\n'
    (folder / "search" / "atv312.toml").write_text(text, encoding="utf-8")
    (fault,) = library.all_faults_of(folder / "atv312.toml")
    assert fault.endswith("search/atv312.toml:1: topic ramp: there is no parameter 'NONE'.")
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    profile = library.load_file(folder / "atv312.toml")
    assert next(iter(rows(FilterContext(profile), "all", "ramp"))) == "ACC"


def test_packaged_words_of_codes_that_an_own_edition_lacks_are_skipped() -> None:
    data = library.load("atv71").data
    listed = tomli.loads((FOLDER / "atv71.toml").read_text("utf-8"))["topics"][0]["codes"][0]
    kept = [parameter for parameter in data.parameters if parameter.code != listed]
    edition = msgspec.structs.replace(data, parameters=kept)
    with pytest.raises(ProfileError, match=f"there is no parameter '{listed}'"):
        read_vocabulary(edition, (FOLDER.parent,))
    topics = read_vocabulary(edition, (FOLDER.parent,), strict=False).topics
    assert listed not in {code for topic in topics for code in topic.codes}


@pytest.mark.parametrize("family", FAMILIES)
def test_each_word_of_a_topic_finds_its_first_parameter(family: str) -> None:
    profile = library.load(family)
    topics = [
        topic for topic in read_vocabulary(profile.data, (FOLDER.parent,)).topics if topic.codes
    ]
    assert topics
    without_synonyms = ParameterSearch(profile, Vocabulary(tuple(topics)))
    for search in (parameter_search(profile), without_synonyms):
        missed = [
            (topic.codes[0], word)
            for topic in topics
            for word in topic.words
            if topic.codes[0] not in search.scores(word)
        ]
        assert missed == []


def test_each_topic_finds_a_parameter_and_is_defined_once() -> None:
    shared = msgspec.convert(tomli.loads((FOLDER / "words.toml").read_text("utf-8")), SearchWords)
    ids = [topic.id for topic in shared.topics]
    assert len(ids) == len(set(ids))
    for topic in shared.topics:
        text = topic.words[0]
        assert any(found(family, text) for family in FAMILIES), topic.id
    spelled = [
        word for group in shared.synonyms for text in group for word in {*search_words(text)}
    ]
    assert sorted({word for word in spelled if spelled.count(word) > 1}) == []
    lone = [group for group in shared.synonyms if len({search_words(word) for word in group}) < 2]
    assert lone == [], "a group of one word says nothing"


def test_words_are_not_read_with_the_profile(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def noted(data: Any, _folders: object) -> Vocabulary:
        read.append(data.profile.id)
        return Vocabulary()

    monkeypatch.setattr("tui.drive.profile.search.read_vocabulary", noted)
    profile = library.load_file(FOLDER.parent / "varmeca.toml")
    rows(FilterContext(profile), "all")
    assert read == []
    rows(FilterContext(profile), "all", "ramp")
    rows(FilterContext(profile), "all", "brake")
    assert read == ["varmeca"]


def test_committed_schema_of_words_is_up_to_date() -> None:
    committed = (FOLDER / "search.schema.json").read_text("utf-8")
    assert committed == json_schema.schema_text("search")


def test_document_names_every_field_of_words() -> None:
    text = (FOLDER.parent / "README.md").read_text("utf-8")
    section = text.partition("## The words of a search\n")[2].partition("\n## ")[0]
    shared, family = section.split("A file `search/ID.toml`")
    for part, kinds in (
        (shared, (SearchTopic, SearchWords)),
        (family, (FamilyTopic, FamilySearch)),
    ):
        fields = {field.name for kind in kinds for field in msgspec.structs.fields(kind)}
        assert [name for name in sorted(fields) if not re.search(rf"`(\[\[)?{name}\b", part)] == []
