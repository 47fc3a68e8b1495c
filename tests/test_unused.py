"""The package has no function, class or constant that nothing in it uses."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from .sources import PACKAGE, modules, tree_of, walked

CALLED_BY_OTHERS = re.compile(
    r"__\w+__|(on|action|watch|key|validate|check)_\w+"  # Textual finds these by their names
    r"|main|visit_\w+"
)
FOR_OTHERS = {
    "app.py": {"DrivePanelApp"},
    "bus/fake.py": {"FakeLine", "fail_read", "fail_write", "fail_identify"},
    "session/api": {"*"},
    "simulator": {"*"},
    "cli/commands": {"*"},
}
"""By prefix of a module's path: names for tests, scripts, or callers by name."""
HOOKS = {
    "compose", "render_line", "get_default_screen", "get_driver_class", "get_theme",
    "connection_made", "data_received", "connection_lost", "feed_data", "format_commands",
    "format_completion", "source_template", "highlight", "enqueue", "handleError", "emit",
    "run_input_thread", "WithMouse", "Drawing", "restarts", "redrawn", "watchdog",
    "panic", "_fatal_error", "_sigcont_application", "createLock",
}  # fmt: skip
"""Names that libraries call, and names kept for tests."""


def defined(tree: ast.Module) -> Iterator[str]:
    """Yield functions, classes, methods and constants at any level."""
    for node in walked(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name
    for node in tree.body:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def used(tree: ast.Module) -> Iterator[str]:
    """Yield names that are read, and words of texts: tables name what they call."""
    for node in walked(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(attr=name):
                yield name
            case ast.ImportFrom(names=names):
                yield from (alias.name for alias in names)
            case ast.keyword(arg=str() as name):
                yield name
            case ast.Constant(value=str() as text) if len(text) < 80:
                yield from re.findall(r"\w+", text)


def unused(trees: dict[str, ast.Module]) -> list[str]:
    """Return unused definitions, by module."""
    names = {name for tree in trees.values() for name in used(tree)}
    return [
        f"{module}: {name}"
        for module, tree in trees.items()
        for name in defined(tree)
        if name not in names and not CALLED_BY_OTHERS.fullmatch(name) and name not in HOOKS
        if not any(
            module.startswith(place) and kept & {name, "*"} for place, kept in FOR_OTHERS.items()
        )
    ]


def test_every_name_is_used() -> None:
    trees = {path.relative_to(PACKAGE).as_posix(): tree_of(path) for path in modules()}
    assert unused(trees) == [], "take it out, with the tests that only try it"


@pytest.mark.parametrize(
    ("source", "reported"),
    [
        ("def f(): ...\nX = 1\nclass C:\n    def m(self): ...\n", ["f", "X", "C", "m"]),
        ("def f(): ...\nX = f()\nprint(X)\n", []),
        ("def f(): ...\nTABLE = {'key': 'f'}\nprint(TABLE)\n", []),
        ("class C:\n    def on_key(self): ...\nC()\n", []),
    ],
)
def test_unused_name_is_found(source: str, reported: list[str]) -> None:
    found = unused({"m.py": ast.parse(source)})
    assert sorted(found) == sorted(f"m.py: {name}" for name in reported)
