"""No module or class exceeds the size limit, unless its reason is listed here."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache

import pytest

from .sources import PACKAGE, ROOT, modules, tree_of

MOST_LINES = 400
MOST_METHODS = 15
"""Most public methods and properties of a class; those of its bases count there."""

EXCEPTIONS: dict[str, tuple[int, str]] = {
    "bus/api.py:ModbusLine": (20, "the complete interface of a line; the fake has the same"),
    "bus/fake.py:FakeLine": (18, "the same interface, for tests"),
    "bus/shared_state.py:SharedState": (18, "all state that the programs on a line share"),
    "session/record/replay_line.py:ReplayLine": (17, "the same interface, on a record"),
    "screens/app_port.py:Panel": (28, "the complete interface of the app for screens"),
    "screens/connection/state.py:LineView": (
        19,
        "lists, form, search, named for the keys",
    ),
}
"""Exceptions by module, or module and class: the size and the reason."""


def sizes(source: str, tree: ast.Module, module: str) -> Iterator[tuple[str, int, int]]:
    """Yield the sizes of a module and its classes, with their limits."""
    yield module, len(source.splitlines()), MOST_LINES
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            public = {
                part.name
                for part in node.body
                if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef)
                and not part.name.startswith("_")
            }
            yield f"{module}:{node.name}", len(public), MOST_METHODS


@cache
def project_sizes() -> list[tuple[str, int, int]]:
    return [
        size
        for path in modules()
        for size in sizes(
            path.read_text("utf-8"), tree_of(path), path.relative_to(PACKAGE).as_posix()
        )
    ]


def too_large(found: list[tuple[str, int, int]]) -> list[str]:
    """Return sizes above the limit, or above their exception."""
    return [
        f"{name}: {size}, and {EXCEPTIONS.get(name, (most, ''))[0]} at most"
        for name, size, most in found
        if size > EXCEPTIONS.get(name, (most, ""))[0]
    ]


def test_modules_and_classes_stay_within_their_size() -> None:
    assert too_large(project_sizes()) == [], "cut it along its reasons to change"


def test_every_exception_is_needed_and_has_a_reason() -> None:
    past = {name: size for name, size, most in project_sizes() if size > most}
    assert EXCEPTIONS.keys() <= past.keys(), "it has become small: take its exception out"
    assert all(reason for _, reason in EXCEPTIONS.values())


def test_architecture_page_lists_exceptions_with_sizes() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    rows = re.findall(
        r"^\| `([\w/]+)` \| (\d+) ", text.partition("\n## Sizes above")[2], re.MULTILINE
    )
    past = {
        (name.partition(":")[2] or name.removesuffix(".py")): str(size)
        for name, size, most in project_sizes()
        if size > most
    }
    assert dict(rows) == past


@pytest.mark.parametrize(
    ("source", "reported"),
    [
        ("x = 1\n" * (MOST_LINES + 1), ["m.py: 401, and 400 at most"]),
        ("x = 1\n" * MOST_LINES, []),
        (
            "class Big:\n" + "".join(f"    def m{n}(self): ...\n" for n in range(16)),
            ["m.py:Big: 16, and 15 at most"],
        ),
        (
            "class Big:\n" + "".join(f"    def _m{n}(self): ...\n" for n in range(16)),
            [],
        ),
    ],
    ids=["long", "just short enough", "many methods", "private methods"],
)
def test_oversized_module_is_reported(source: str, reported: list[str]) -> None:
    assert too_large(list(sizes(source, ast.parse(source), "m.py"))) == reported
