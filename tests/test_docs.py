"""Names in the documents exist: packages, classes with their members, functions, links."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import pytest

from .sources import ROOT, modules, nodes_of

TREES = ("tui", "tests", "benchmarks", "screenshots")
DOCUMENTS = sorted([*(ROOT / "docs").rglob("*.md"), ROOT / "CONTRIBUTING.md"])
FOREIGN = frozenset({"DataTable", "Digits", "Sparkline", "Text", "TYPE_CHECKING"})
"""Third-party names that documents write like a class of the project."""

FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
SPAN = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)

FOLDER_OR_FILE = re.compile(r"\.?[\w-][\w.-]*(?:/[\w.*-]+)*/?")
MODULE = re.compile(rf"(?:{'|'.join(TREES)})(?:\.\w+)+")
CLASS = re.compile(r"(?P<name>_?[A-Z][A-Za-z0-9]*[a-z][A-Za-z0-9]*)(?:\.(?P<part>\w+)(?:\(\))?)?")
FUNCTION = re.compile(r"(?P<name>[a-z_]\w*)\(\)")
CONSTANT = re.compile(r"(?!DRIVEPANEL_)[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+")
SUFFIXES = (".py", ".md", ".toml", ".txt", ".tcss")


class Tree(NamedTuple):
    """Definitions of the code, by name."""

    classes: dict[str, set[str]]
    """Members of each class: methods, fields, attributes set on `self`, and its bases."""
    bases: dict[str, set[str]]
    functions: set[str]
    constants: set[str]


@lru_cache(maxsize=1)
def tree() -> Tree:
    """Collect all definitions of the project's modules."""
    found = Tree(defaultdict(set), defaultdict(set), set(), set())
    for folder in TREES:
        for path in modules(ROOT / folder):
            for node in nodes_of(path):
                _note(node, found)
    return found


def _note(node: ast.AST, found: Tree) -> None:
    match node:
        case ast.ClassDef():
            found.bases[node.name].update(
                ast.unparse(base).rpartition(".")[2] for base in node.bases
            )
            found.classes[node.name].update(_parts(node))
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            found.functions.add(node.name)
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            found.constants.add(name)
            # an alias, as a Literal is, may be named like a class
            found.classes[name].update(())


def _parts(of: ast.ClassDef) -> Iterator[str]:
    for node in ast.walk(of):
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                yield node.name
            case ast.AnnAssign(target=ast.Name(id=name)):
                yield name
            case ast.Assign():
                yield from (t.id for t in node.targets if isinstance(t, ast.Name))
            case ast.Attribute(value=ast.Name(id="self"), attr=name):
                yield name


def has_part(name: str, part: str) -> bool:
    """True if a class, or one of its bases, has a method or field of that name."""
    known, seen, waiting = tree(), {""}, [name]
    while waiting:
        if (text := waiting.pop()) in seen:
            continue
        if part in known.classes.get(text, ()):
            return True
        seen.add(text)
        waiting += known.bases.get(text, ())
    return False


def is_module(dotted: str) -> bool:
    """True if a dotted name is a package, a module, or a definition in a module."""
    place = ROOT.joinpath(*dotted.split("."))
    if place.is_dir() or place.with_suffix(".py").is_file():
        return True
    module, last = place.parent.with_suffix(".py"), place.name
    if not module.is_file():
        module = place.parent / "__init__.py"
    return module.is_file() and re.search(rf"\b{last}\b", module.read_text("utf-8")) is not None


def faults(text: str) -> Iterator[str]:
    """Yield names in a document that do not exist, or that the next move would break."""
    for span in SPAN.findall(FENCE.sub("", text)):
        if fault := _fault(span):
            yield f"{span}: {fault}"


def _fault(span: str) -> str:
    known = tree()
    if MODULE.fullmatch(span) and not span.endswith(SUFFIXES):
        return "" if is_module(span) else "no such module"
    if FOLDER_OR_FILE.fullmatch(span) and ("/" in span or span.endswith(SUFFIXES)):
        return _fault_of_path(span)
    if found := FUNCTION.fullmatch(span):
        return "" if found["name"] in known.functions else "no such function"
    if CONSTANT.fullmatch(span) and span not in FOREIGN:
        return "" if span in known.constants else "no such constant"
    if (found := CLASS.fullmatch(span)) and found["name"] not in FOREIGN:
        name, part = found["name"], found["part"]
        if name not in known.classes:
            return "no such class"
        if part and not has_part(name, part):
            return f"{name} has no {part}"
    return ""


def _fault_of_path(span: str) -> str:
    """`NAME` in a path stands for any name; a file without a folder may be in any."""
    path = span.rstrip("/").replace("NAME", "*")
    top = path.partition("/")[0]
    if "/" in path and not (ROOT / top).is_dir():
        return ""  # a path in a user's folders, or on the line
    folders = [ROOT / tree for tree in (*TREES, "docs", "profiles")] if "/" not in path else []
    if not any((*ROOT.glob(path), *(found for folder in folders for found in folder.rglob(path)))):
        return "not there"
    if top == "tui" and path.endswith(".py") and "*" not in path:
        return "name the room and the class: files move"
    return ""


def anchors(path: Path) -> set[str]:
    """Return the anchors of a document."""
    heads = HEADING.findall(FENCE.sub("", path.read_text("utf-8")))
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def lost_links(path: Path, text: str) -> Iterator[str]:
    """Yield links of a document without a target."""
    for target in LINK.findall(FENCE.sub("", text)):
        place, _, anchor = target.partition("#")
        if "://" in target or target.startswith("mailto:"):
            continue
        there = (path.parent / place).resolve() if place else path
        if not there.exists() or (anchor and anchor not in anchors(there)):
            yield target


def test_documents_are_found() -> None:
    names = {path.relative_to(ROOT).as_posix() for path in DOCUMENTS}
    assert {"docs/architecture.md", "docs/glossary.md", "CONTRIBUTING.md"} <= names
    assert len([name for name in names if name.startswith("docs/decisions/")]) >= 9


@pytest.mark.sweep
def test_documents_name_existing_things_only() -> None:
    """One test for all documents, as the search for names parses the whole source first."""
    found = {}
    for path in DOCUMENTS:
        text = path.read_text("utf-8")
        found[path.relative_to(ROOT).as_posix()] = [*faults(text), *lost_links(path, text)]
    assert {name: reported for name, reported in found.items() if reported} == {}


@pytest.mark.sweep  # with the test above, which reads the whole source, too
def test_wrong_names_fail_the_check() -> None:
    wrong = (
        "`Lyne`",
        "`Line.reed`",
        "`Line.reed()`",
        "`MonitorScreen.reed`",
        "`no_such_function()`",
        "`tui/nowhere`",
        "`tui/bus/line.py`",
        "`tests/NAME/nothing.py`",
        "`nothing.md`",
        "`tui.bus.lyne`",
        "`tui.bus.line.Lyne`",
        "`NO_SUCH_CONSTANT`",
    )
    assert [text for text in wrong if not list(faults(text))] == []
    right = (
        "`Line` `Line.read` `MonitorScreen.put` `plan_reads()` `tui.app.DrivePanelApp` `KEY_NAMES`"
    )
    right += " `tui/bus/rtu` `tests/NAME/conftest.py` `pyproject.toml` `docs/decisions/`"
    right += (
        " `DataTable` `r` `sim:atv71` `OrderId` `Priority.STOP` `/dev/ttyUSB0` `1.05` `16#FD00`"
    )
    assert list(faults(right)) == []
    assert list(faults("```\nLyne `Lyne`\n```")) == []


def test_broken_link_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# A head, and more\n", "utf-8")
    reported = "[a](page.md) [b](page.md#a-head-and-more) [c](https://example.org/x)"
    assert list(lost_links(page, reported)) == []
    assert list(lost_links(page, "[a](other.md) [b](page.md#no) [c](#no)")) == [
        "other.md",
        "page.md#no",
        "#no",
    ]


FAMILY = re.compile(r"\batv\d|altivar|leroy|powerdrive|proxidrive|varmeca|px-modbus|drivecom", re.I)
HOLDS_FAMILIES = "Where Python still knows a family"


def rooms_that_know_a_family(package: Path) -> set[str]:
    """Return folders with a module that names a family; the simulator is exempt."""
    return {
        path.parent.relative_to(package.parent).as_posix()
        for path in package.rglob("*.py")
        if package / "simulator" not in path.parents and FAMILY.search(path.read_text("utf-8"))
    }


def test_every_package_that_knows_a_family_is_listed() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    section = text.partition(f"\n## {HOLDS_FAMILIES}")[2].partition("\n## ")[0]
    reported = {span for span in SPAN.findall(section) if span.startswith("tui")}
    assert rooms_that_know_a_family(ROOT / "tui") - reported == set()


def test_package_that_knows_a_family_is_found(tmp_path: Path) -> None:
    for room in ("bus", "simulator"):
        (tmp_path / "tui" / room).mkdir(parents=True)
        (tmp_path / "tui" / room / "new.py").write_text('if profile.id == "atv71": pass', "utf-8")
    assert rooms_that_know_a_family(tmp_path / "tui") == {"tui/bus"}


def test_readme_links_to_the_documents() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    targets = set(LINK.findall(readme))
    wanted = {"docs/architecture.md", "docs/decisions", "docs/glossary.md"}
    assert wanted | {"CONTRIBUTING.md", "CHANGELOG.md"} <= targets


def test_every_decision_is_in_the_list() -> None:
    index = (ROOT / "docs" / "decisions" / "README.md").read_text("utf-8")
    pages = {path.name for path in (ROOT / "docs" / "decisions").glob("*.md")} - {"README.md"}
    assert set(LINK.findall(index)) == pages
