"""Wording: no text has a phrase that a reader stumbles over, except those with a reason.

`python -m tests.test_texts [NUMBER...]` lists every hit of a check with its file and line.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
import tomli

from .glue import all_glued, glued
from .sources import ROOT, modules, tree_of, walked

TESTS = ROOT / "tests"
FIRST_COMMIT = "2b17417"
"""Subjects of later commits are checked."""

BASE_VERBS = """
accept add allow answer append apply arm back begin change check close coast collect
compare complete copy count create delete diagnose discard do ends exit explain export find
follow force give go hide identify ignore import include keep learn leave limit list
listen load log look make map mark monitor name open omit overwrite pause plot poll
print probe publish put quit read record refuse reject remember remove repeat replace
reply report require reset restore resume retry return run save scan search select send
serve set share show sign simulate skip sleep sort start stop store take test try undo
use verify wait watch write
"""


class Text(NamedTuple):
    """One text with its place."""

    kind: str
    """U literal, S docstring, N name, L click help, D Markdown, G commit subject, T test name,
    P text of a profile."""
    path: str
    line: int
    text: str


class Check(NamedTuple):
    """A phrase to avoid in texts of these kinds."""

    kinds: str
    hits: Callable[[str], int]
    bad: str
    """An example that must be hit."""


def of(pattern: str, flags: int = re.IGNORECASE) -> Callable[[str], int]:
    """Count the matches of a pattern."""
    found = re.compile(pattern, flags)
    return lambda text: sum(1 for _ in found.finditer(text))


def _long(text: str) -> int:
    """Count sentences over 25 words, or with two colons or semicolons."""
    sentences = re.split(r"(?<=[.!?])\s+", text)
    return sum(
        len(sentence.split()) > 25 or len(re.findall(r"[:;](?=\s|$)", sentence)) > 1
        for sentence in sentences
    )


def _no_imperative(text: str) -> int:
    first = re.match(r"\w+", text)
    verb = first is not None and first[0].lower() in BASE_VERBS.split()
    return int(not verb or len(text.partition("\n")[0]) > 60)


CHECKS: dict[int, Check] = {
    1: Check("UDS", of(r"\b(is|are|was|be) told\b"), "it is told"),
    2: Check("UDS", of(r"\btells?\b(?! apart)"), "a drive tells it"),
    3: Check("UDS", of(r"\bask(s|ed)? (\S+ ){0,2}on\b"), "the drive is asked on"),
    4: Check("UDS", of(r"asked? no more|nobody asks"), "it is asked no more"),
    5: Check("UDS", of(r"\bof now\b"), "values of now"),
    6: Check("UD", of(r"unless told"), "unless told otherwise"),
    7: Check("UDS", of(r"\bwhoever\b|\bfor who\b|who it is"), "whoever starts"),
    8: Check("UDS", of(r"(?<!there )\b(is|are) no (?!longer)\w+"), "x is no line"),
    9: Check("UDS", of(r"\banew\b|\bmend"), "read anew"),
    10: Check("UDS", of(r"\ball the same\b|(?<!restart )\bby itself\b"), "ends by itself"),
    11: Check("UD", of(r"from (here|elsewhere)\b|\bof others\b"), "commanded from here"),
    12: Check("UD", of(r"\bgo(es)? (out|by|with)\b|\bwent out\b"), "the frame goes out"),
    13: Check("U", of(r"there already|is there again"), "x is there already"),
    14: Check("UD", of(r"\b(no|some|any)body\b"), "nobody answers"),
    15: Check("UDS", of(r"\bstands?\b(?! for\b)"), "it stands there"),
    16: Check("UDS", of(r"\b(became|becomes?) of\b|\bc(a|o)mes? to\b"), "what becomes of it"),
    17: Check("UDS", of(r"\btime-outs?\b"), "its time-out"),
    18: Check(
        "UDSNL",
        of("colour|favourite|neighbour|behaviour|analogue|licence|recognis"),
        "one_colour",
    ),
    19: Check(
        "N",
        of(
            r"(?i:(^|_)(told|asked|meant|whom|said|hush\w*|stir)(_|$))"
            r"|(Told|Asked|Meant)($|[A-Z])",
            0,
        ),
        "told_by",
    ),
    20: Check("N", of(r"^_?of_", 0), "of_drives"),
    21: Check(
        "U",
        of(r"^(takes|keeps|leaves|writes|gives|does|closes|opens)( \w+)?$", 0),
        "takes it",
    ),
    22: Check("L", _no_imperative, "What a drive does"),
    23: Check("S", of(r"\A(What|Who|Whom|Whether|Where|How)\b", 0), "What it does."),
    24: Check("D", _long, "It is: one; and then two: three."),
    25: Check(
        "G",
        lambda text: int(bool(re.match(r"(A|An|The|What|Who|Where|No|One)\b", text))
                         or len(text) > 72),
        "The line is open",
    ),
    27: Check("N", of(r"^one$", 0), "one"),
    26: Check("T", of(r"^test_(what|who|where|the_order_of|\d)_", 0), "test_who_asks"),
    28: Check(
        "T",
        of(r"_(nobody|somebody|anybody|whoever|anew|meanwhile|elsewhere)(_|$)"
           r"|^test_(it|its|one_that|of_two)_|all_the_same", 0),
        "test_it_is_read_by_nobody",
    ),
}  # fmt: skip

PROFILE_CHECKS = (*range(1, 19), 24)
CHECKS |= {n: CHECKS[n]._replace(kinds=f"{CHECKS[n].kinds}P") for n in PROFILE_CHECKS}
NOT_OURS = {"drawing", "printed", "title", "source", "quantity", "quantities"}
"""Keys of profiles that are not checked: drawings, quotes, documents, names that stay."""

EXCEPTIONS: dict[tuple[int, str, str], str] = {
    (9, "counted-anew", "tui/session/counters"): "a kind in the JSON of `counters`",
    (9, "mended", "tui/session"): "a kind of entry in journals, also of earlier versions",
    (18, "analogue_input_1", "tui/drive/profile/schema"): "a quantity of profiles",
    (18, "analogue_input_2", "tui/drive/profile/schema"): "a quantity of profiles",
    (15, "stand-by", "tui/drive/values.py"): "a name of a value in older backups",
    (18, "analogue", "tui/drive/values.py"): "a word of such names",
    (18, "analogue", "profiles/search"): "a word that a person types",
    (18, "favourites", "tui/session/settings/editor.py"): "the key in stored files",
    (19, "asked", "tui/cli/documents"): "a JSON field of `why`, `counters` and `listen`",
}
"""By check, whole text and place: the reason why a hit stays. The texts are public."""


GLUED = {
    ("tui/drive/sentences.py", "{text.rstrip('.')}"): "the one function that ends sentences",
    (
        "tui/screens/keys/pages.py",
        "' or '.join((key_text(key) for key in action.keys.split(',')))",
    ): ("pages of the documentation, which tests read"),
    ("tui/drive/sentences.py", "text[:1].upper()"): "the one function for a capital first letter",
}
"""By module and source of a glued text: the reason why it stays."""


def _docstrings(tree: ast.Module) -> Iterator[ast.Constant]:
    """Docstrings, those of attributes included: strings that are statements."""
    for node in walked(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str()) as text):
                yield text


def texts_of(source: ast.Module, path: str, kinds: str = "USNL") -> Iterator[Text]:
    """Every text of a module, by kind."""
    documents = {id(node) for node in _docstrings(source)}
    for node in walked(source):
        match node:
            case ast.Constant(value=str(text)):
                kind = "S" if id(node) in documents else "U"
                if kind in kinds:
                    yield Text(kind, path, node.lineno, text.strip() if kind == "S" else text)
            case ast.Assign(targets=[ast.Name(id="COMMANDS")], value=ast.Dict(values=rows)):
                texts = [row.elts[-1] for row in rows if isinstance(row, ast.Tuple)]
                yield from (Text("L", path, t.lineno, text) for t in texts for text in _joined(t))
            case ast.Call(keywords=keywords) if "L" in kinds:
                for keyword in keywords:
                    if keyword.arg in ("help", "short_help"):
                        yield from (
                            Text("L", path, node.lineno, text) for text in _joined(keyword.value)
                        )
        if "N" in kinds:
            yield from (Text("N", path, line, name) for line, name in _names(node))
        if "T" in kinds and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield Text("T", path, node.lineno, node.name)


def _joined(value: ast.expr) -> Iterator[str]:
    match value:
        case ast.Constant(value=str(text)):
            yield text
        case ast.JoinedStr(values=parts):
            yield "".join(str(p.value) if isinstance(p, ast.Constant) else "X" for p in parts)


def _names(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Names that a node gives to something, each with its line."""
    match node:
        case ast.ClassDef() | ast.FunctionDef() | ast.AsyncFunctionDef():
            yield node.lineno, node.name
        case ast.arg():
            yield node.lineno, node.arg
        case ast.Name(ctx=ast.Store()):
            yield node.lineno, node.id
        case ast.Attribute(ctx=ast.Store()):
            yield node.lineno, node.attr


def _paragraphs(path: Path) -> Iterator[Text]:
    """Prose of a Markdown file: paragraphs, list items, table cells; no code, no comments."""
    text = path.read_text("utf-8")
    text = re.sub(r"^```.*?^```", lambda m: "\n" * m[0].count("\n"), text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    name, begun, held = path.relative_to(ROOT).as_posix(), 1, ""
    for number, line in enumerate([*text.splitlines(), ""], 1):
        starts = re.match(r"\s*(?:[-*>#]+|\d+\.) ", line)
        is_row = line.lstrip().startswith("|")
        if held and (not line.strip() or starts or is_row):
            yield Text("D", name, begun, held)
            held = ""
        if is_row:
            yield from (Text("D", name, number, cell.strip()) for cell in line.split("|"))
        elif line.strip():
            begun = begun if held else number
            held = f"{held} {line.strip()}".strip()


def _profile_texts(path: Path) -> Iterator[Text]:
    """Texts and comments of a profile, of shared rows or of help."""
    source, name = path.read_text("utf-8"), path.relative_to(ROOT).as_posix()
    lines: dict[str, int] = {}
    for number, line in enumerate(source.splitlines(), 1):
        if line.startswith("#"):
            yield Text("P", name, number, line.lstrip("# "))
        for literal in re.findall(r'"((?:[^"\\]|\\.)*)"', line):
            lines.setdefault(literal.replace('\\"', '"'), number)
    for text in _ours(tomli.loads(source)):
        yield Text("P", name, lines.get(text, 0), text)


def _ours(part: object) -> Iterator[str]:
    match part:
        case str():
            yield part
        case list():
            yield from (text for item in part for text in _ours(item))
        case dict():
            kept = (item for key, item in part.items() if key not in NOT_OURS)
            yield from (text for item in kept for text in _ours(item))


def _subjects() -> Iterator[Text]:
    """Subjects of new commits; none outside a repository, or if it starts later."""
    git = ["git", "-C", str(ROOT), "log", "--format=%s", f"{FIRST_COMMIT}..HEAD"]
    if (ROOT / ".git").exists():
        found = subprocess.run(git, capture_output=True, text=True, check=False)
        yield from (Text("G", "git log", 0, line) for line in found.stdout.splitlines())


@cache
def all_texts() -> tuple[Text, ...]:
    """Every text that is checked."""
    found: list[Text] = []
    for path in modules():
        name = path.relative_to(ROOT).as_posix()
        found += texts_of(tree_of(path), name)
        found.append(Text("N", name, 0, path.stem))
    for path in modules(TESTS):
        found += texts_of(tree_of(path), path.relative_to(ROOT).as_posix(), "SNT")
    for path in modules(ROOT / "benchmarks"):
        found += texts_of(tree_of(path), path.relative_to(ROOT).as_posix(), "S")
    for folder in (ROOT / "docs", ROOT / "profiles", ROOT / "benchmarks", TESTS):
        for page in sorted(folder.rglob("*.md")):
            found += _paragraphs(page)
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"):
        found += _paragraphs(page)
    for path in sorted((ROOT / "profiles").rglob("*")):
        if path.suffix in (".toml", ".rows"):
            found += _profile_texts(path)
    return (*found, *_subjects())


def hits(number: int, texts: Iterable[Text]) -> Iterator[tuple[Text, int]]:
    """Yield the texts that a check rejects, and the number of hits in each."""
    check = CHECKS[number]
    for text in texts:
        count = check.hits(text.text) if text.kind in check.kinds else 0
        if count and not is_excepted(number, text):
            yield text, count


def is_excepted(number: int, text: Text) -> bool:
    """Return True if a hit has a reason to stay."""
    return any(
        (number, text.text) == (check, excepted) and text.path.startswith(place)
        for check, excepted, place in EXCEPTIONS
    )


@pytest.mark.parametrize("number", CHECKS)
def test_no_text_has_a_phrase_to_avoid(number: int) -> None:
    found = {f"{text.path}:{text.line}: {text.text}" for text, _ in hits(number, all_texts())}
    assert not found


def test_every_exception_is_needed() -> None:
    for number, excepted, place in EXCEPTIONS:
        check = CHECKS[number]
        assert check.hits(excepted)
        assert any(
            text.text == excepted and text.kind in check.kinds and text.path.startswith(place)
            for text in all_texts()
        ), excepted


def test_exception_holds_for_its_place_only() -> None:
    public = Text("N", "tui/cli/documents/parts.py", 1, "asked")
    assert not list(hits(19, [public]))
    assert list(hits(19, [public._replace(path="tui/bus/line.py")]))


@pytest.mark.parametrize("number", CHECKS)
def test_check_finds_its_example(number: int) -> None:
    check = CHECKS[number]
    bad = Text(check.kinds[0], "x", 1, check.bad)
    assert list(hits(number, [bad]))
    assert not list(hits(number, [bad._replace(text="Stop the motor.")]))


def test_no_text_is_glued_from_pieces() -> None:
    found = {
        f"{item.path}:{item.line}: {item.form}: {item.text}"
        for item in all_glued()
        if (item.path, item.text) not in GLUED
    }
    assert not found


@pytest.mark.sweep
def test_every_exception_of_glue_is_needed() -> None:
    assert {(item.path, item.text) for item in all_glued()} >= GLUED.keys()


@pytest.mark.parametrize(
    ("form", "source"),
    [
        ("capital", "text = f'{name[0].upper()}{name[1:]} stops.'"),
        ("capital", "text = name[:1].lower()"),
        ("switch", """text = f'{count} drive{"s" if count > 1 else ""} found'"""),
        ("switch", """text = f'It {"runs" if runs else f"may run for {time}"}.'"""),
        ("plus", "text = name + ' has left the line.'"),
        ("plus", "text += f' Retrying in {seconds} s.'"),
        ("plus", "text = '; '.join(texts) + '.'"),
        ("full stop", """text = f'{meaning.rstrip(".")}.'"""),
        ("list", "text = ' and '.join(names)"),
        ("fragment", "early = '' if done else ', not all of which were polled'"),
        ("fragment", "more = f' and {count} more'"),
        ("fragment", "after = ' (until the next reset)'"),
    ],
)
def test_glue_is_found(form: str, source: str) -> None:
    assert form in {item.form for item in glued(ast.parse(source), "x.py")}


@pytest.mark.parametrize(
    "source",
    [
        "text = f'{name} has left the line.'",
        "text = one if count == 1 else many",
        "text = ', '.join(names)",
        "text = ' '.join([text, 'Press s to scan again.'])",
        "text = f'{text} Press s to scan again.'",
        "key = ' stop'",
        "label = ' load of the line '",
        "path = name + '.toml'",
        "head = text.removesuffix(' of the drive')",
        "'''Document, with text.'''",
    ],
)
def test_whole_sentence_is_not_glue(source: str) -> None:
    assert not list(glued(ast.parse(source), "x.py"))


def test_texts_of_a_module_are_sorted_by_kind() -> None:
    source = '''
"""Module."""
LIMIT = "on the screen"
"""Attribute."""

def run(motor: int) -> None:
    """Function."""
    click.option("--x", help=f"Show {motor}.")
    raise ValueError(f"no {motor} here")
'''
    found = list(texts_of(ast.parse(source), "m.py"))
    by_kind = {kind: {text.text for text in found if text.kind == kind} for kind in "USNL"}
    assert by_kind["S"] == {"Module.", "Attribute.", "Function."}
    assert {"on the screen", "--x", "no ", " here"} <= by_kind["U"]
    assert by_kind["N"] == {"LIMIT", "run", "motor"}
    assert by_kind["L"] == {"Show X."}


LOG_CALLS = {"debug", "info", "warning", "error", "exception"}


def wrong_log_calls(tree: ast.Module) -> Iterator[int]:
    """Lines of calls to the log whose text is missing, or does not fit the number of values."""
    for node in walked(tree):
        match node:
            case ast.Call(func=ast.Attribute(ast.Name("log"), name), args=args) if (
                name in LOG_CALLS
            ):
                match args:
                    case [ast.Constant(value=str() as text), *values] if text:
                        if len(re.findall("%[^%]", text)) == len(values):
                            continue
                yield node.lineno


def test_each_log_text_fits_its_values() -> None:
    wrong = {str(path): list(wrong_log_calls(tree_of(path))) for path in modules()}
    assert {path: lines for path, lines in wrong.items() if lines} == {}
    bad = 'log.info("")', 'log.info(name, "%s")', 'log.info("%s of %s", name)', "log.error(text)"
    assert all(list(wrong_log_calls(ast.parse(source))) == [1] for source in bad)


def test_prose_excludes_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text(
        "# Head\n\nOne\ntwo.\n\n```sh\ncode\n```\n- item\n- more\n\n  | a | b |\n", "utf-8"
    )
    assert [paragraph.text for paragraph in _paragraphs(page) if paragraph.text] == [
        "# Head", "One two.", "- item", "- more", "a", "b",
    ]  # fmt: skip


def test_texts_of_a_profile_exclude_manual_quotes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    path = tmp_path / "pump.toml"
    path.write_text(
        '# Faults\n[[errata]]\nprinted = "Analogue"\nright = "The \\"dry\\" bit"\n'
        'bits = [{ bit = 0, name = "Dry", on = "yes" }]\nvalues = { 1 = "Level" }\n',
        "utf-8",
    )
    found = {text.text: text.line for text in _profile_texts(path)}
    assert found == {"Faults": 1, 'The "dry" bit': 4, "Dry": 5, "yes": 5, "Level": 6}


if __name__ == "__main__":
    for wanted in [int(item) for item in sys.argv[1:]] or CHECKS:
        listed = list(hits(wanted, all_texts()))
        print(f"{wanted}: {sum(c for _, c in listed)} hits")
        if sys.argv[1:]:
            for text, _ in listed:
                print(f"  {text.path}:{text.line}: {' '.join(text.text.split())[:120]}")
