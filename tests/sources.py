"""The source of the project, parsed once per process for all tests that check it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "tui"


@cache
def modules(folder: Path = PACKAGE) -> tuple[Path, ...]:
    """Return the modules under a folder, by name."""
    return tuple(sorted(folder.rglob("*.py")))


@cache
def tree_of(path: Path) -> ast.Module:
    """Parse a module."""
    return ast.parse(path.read_text("utf-8"))


@cache
def walked(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return all nodes of a tree, from the outside in; kept, as several tests go through them."""
    return tuple(ast.walk(tree))


def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of a module, from the outside in."""
    return walked(tree_of(path))


def calls_of(name: str, folder: Path = PACKAGE) -> Iterator[tuple[Path, ast.Call]]:
    """Yield the calls of a name, alone or as an attribute, each with its module."""
    for path in modules(folder):
        if f"{name}(" in path.read_text("utf-8"):
            for node in nodes_of(path):
                match node:
                    case ast.Call(func=ast.Name(id=found) | ast.Attribute(attr=found)):
                        if found == name:
                            yield path, node
