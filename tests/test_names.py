"""Each public name has one meaning, so that a search finds it once."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator

from .sources import ROOT, modules, tree_of

LIKE_A_COMMAND = {"compare", "identify", "main", "report", "restore"}
"""Functions of the command line have the names of the typed commands."""

FOUND_BY_NAME = {"REGISTERED"}
"""Each package of a screen registers it under this name."""


def public(tree: ast.Module) -> Iterator[str]:
    """Return the public names of a module: classes, functions, constants, types."""
    for node in tree.body:
        match node:
            case ast.ClassDef() | ast.FunctionDef() | ast.AsyncFunctionDef():
                yield node.name
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def test_every_public_name_has_one_meaning() -> None:
    where = defaultdict(list)
    for path in modules():
        for name in public(tree_of(path)):
            if not name.startswith("_") and name not in ("log", "T", "P", "R"):
                where[name].append(path.relative_to(ROOT).as_posix())
    twice = {name: found for name, found in where.items() if len(found) > 1}
    assert {
        name: found for name, found in twice.items() if name not in LIKE_A_COMMAND | FOUND_BY_NAME
    } == {}
