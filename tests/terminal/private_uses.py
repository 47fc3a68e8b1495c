"""Finds where a module of the project uses private parts of Textual, by its source.

A private part is a name with a leading underscore that a class or a module of Textual has. In a
subclass of a Textual class, each private name that `self` inherits counts, on purpose or not. On
other objects, a private name of any class of an app counts.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import tui

PACKAGE = Path(tui.__file__).parent
ROOM = "terminal"
DRAWN_BY = ("textual", "rich")
"""Textual, and the library that it writes with."""
BY_NAME = frozenset({"getattr", "setattr", "hasattr", "delattr"})

Bases = Mapping[str, tuple[type, ...]]
"""Textual's base classes of each class of a module, by qualified name. Those of subclasses that add
another class of Textual are included."""


class Use(NamedTuple):
    """A private name, and the line that has it."""

    name: str
    line: int


def is_private(name: str) -> bool:
    """True if a name is private, so that its owner may change it."""
    return name.startswith("_") and not name.endswith("__")


@cache
def private_names(kind: type) -> frozenset[str]:
    """The private names of one class of Textual or Rich, without those of its bases."""
    names = set(vars(kind)) | set(vars(kind).get("__annotations__", ()))
    source = ast.parse(textwrap.dedent(inspect.getsource(kind)))
    names |= {name for node in ast.walk(source) if (name := _attribute_of_self(node)) is not None}
    return frozenset(filter(is_private, names))


@cache
def names_of_any() -> frozenset[str]:
    """The private names of the classes of an app, from its screens to its drivers and events."""
    from rich.console import Console
    from textual import events, messages
    from textual._compositor import Compositor
    from textual.app import App
    from textual.driver import Driver
    from textual.drivers.linux_driver import LinuxDriver
    from textual.screen import ModalScreen
    from textual.strip import Strip
    from textual.timer import Timer
    from textual.widgets import Input, OptionList, Static, TextArea
    from textual.widgets.option_list import Option

    kinds = [App, ModalScreen, Static, Input, OptionList, TextArea, Compositor, Console]
    kinds += [Driver, LinuxDriver, Option, Strip, Timer]
    kinds += [kind for module in (events, messages) for kind in _classes_of(module)]
    return frozenset().union(
        *(private_names(base) for kind in kinds for base in textual_bases(kind))
    )


def textual_bases(kind: type) -> tuple[type, ...]:
    """The classes of Textual and Rich that a class is or inherits."""
    return tuple(base for base in kind.__mro__ if base.__module__.partition(".")[0] in DRAWN_BY)


def _classes_of(module: object) -> Iterator[type]:
    return (
        kind
        for kind in vars(module).values()
        if isinstance(kind, type) and kind.__module__ == vars(module)["__name__"]
    )


def _attribute_of_self(node: ast.AST) -> str | None:
    """The attribute of `self` or `cls` that this is."""
    if isinstance(node, ast.Attribute) and _is_own(node.value):
        return node.attr
    return None


def _is_own(node: ast.AST) -> bool:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return node.func.id == "super"
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


def uses(source: str, bases: Bases) -> list[Use]:
    """Every use of a private part of Textual in a module with these base classes."""
    tree = ast.parse(source)
    nodes = list(ast.walk(tree))
    return sorted({*_imports(nodes), *_uses_on_others(nodes), *_uses_in_own_classes(tree, bases)})


def _imports(nodes: Sequence[ast.AST]) -> Iterator[Use]:
    """Private modules, and private names of public ones."""
    for node in nodes:
        if isinstance(node, ast.Import):
            paths = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            paths = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for top, *parts in (path.split(".") for path in paths):
            if top in DRAWN_BY and (found := next(filter(is_private, parts), None)):
                yield Use(found, node.lineno)


def _uses_on_others(nodes: Sequence[ast.AST]) -> Iterator[Use]:
    """Private attributes of objects except `self`, and attributes set on a class of Textual."""
    modules, theirs = _imported(nodes)
    for node in nodes:
        if isinstance(node, ast.Attribute) and not _is_own(node.value):
            owner = node.value.id if isinstance(node.value, ast.Name) else ""
            patched = owner in theirs and isinstance(node.ctx, ast.Store | ast.Del)
            if patched or (node.attr in names_of_any() and owner not in modules):
                yield Use(node.attr, node.lineno)
        elif isinstance(node, ast.Call) and (name := _by_name(node, theirs)):
            yield Use(name, node.lineno)


def _by_name(call: ast.Call, theirs: set[str]) -> str | None:
    """The attribute that `getattr` or its like is given by name."""
    if not isinstance(call.func, ast.Name) or call.func.id not in BY_NAME:
        return None
    owner, name, *_ = [*call.args, None, None]
    if not isinstance(name, ast.Constant):
        return None
    patched = call.func.id in ("setattr", "delattr") and (
        isinstance(owner, ast.Name) and owner.id in theirs
    )
    return str(name.value) if patched or name.value in names_of_any() else None


def _imported(nodes: Sequence[ast.AST]) -> tuple[set[str], set[str]]:
    """Names of modules of others than Textual, and names that were imported from Textual."""
    modules: set[str] = set()
    theirs: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            tops = {(alias.asname or alias.name).partition(".")[0] for alias in node.names}
            ours = {name for name in tops if name not in DRAWN_BY}
            modules |= ours
            theirs |= tops - ours
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in DRAWN_BY:
            theirs |= {alias.asname or alias.name for alias in node.names}
    return modules, theirs


def _uses_in_own_classes(tree: ast.Module, bases: Bases) -> Iterator[Use]:
    """Private names that `self` has from Textual: read, set or redefined."""
    for name, node in _classes(tree) if bases else ():
        known = frozenset().union(*(private_names(base) for base in bases.get(name, ())))
        for part in node.body:
            for found, line in _defined(part):
                if found in known:
                    yield Use(found, line)
        for inner in ast.walk(node):
            found_on_self = _attribute_of_self(inner)
            if found_on_self in known and isinstance(inner, ast.Attribute):
                yield Use(inner.attr, inner.lineno)


def _defined(part: ast.stmt) -> Iterator[tuple[str, int]]:
    """Names that a statement in the body of a class binds."""
    if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef):
        yield part.name, part.lineno
    elif isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
        yield part.target.id, part.lineno
    elif isinstance(part, ast.Assign):
        yield from ((n.id, part.lineno) for n in part.targets if isinstance(n, ast.Name))


def _classes(tree: ast.AST, outer: str = "") -> Iterator[tuple[str, ast.ClassDef]]:
    """The classes of a module by their qualified names, as Python gives them."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef):
            yield f"{outer}{node.name}", node
            yield from _classes(node, f"{outer}{node.name}.")
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from _classes(node, f"{outer}{node.name}.<locals>.")
        else:
            yield from _classes(node, outer)


@cache
def bases_in_project() -> Mapping[str, Bases]:
    """Textual's base classes of each class of the project, module by module."""
    found: dict[str, dict[str, tuple[type, ...]]] = {}
    for kind in _own_classes():
        for part in kind.__mro__:
            if part.__module__.partition(".")[0] == tui.__name__:
                below = found.setdefault(part.__module__, {})
                known = below.get(part.__qualname__, ())
                below[part.__qualname__] = tuple(dict.fromkeys([*known, *textual_bases(kind)]))
    return found


def _own_classes() -> Iterator[type]:
    for listed in pkgutil.walk_packages(tui.__path__, f"{tui.__name__}."):
        if not listed.name.endswith("__main__"):
            yield from _classes_of(importlib.import_module(listed.name))
    yield from _driver_classes()


def _driver_classes() -> Iterator[type]:
    """The drivers that are made in a function."""
    from textual.drivers.headless_driver import HeadlessDriver
    from textual.drivers.linux_driver import LinuxDriver

    from tui.terminal.driver import with_own_keys

    make: Callable[[type], type] = with_own_keys.__wrapped__
    for driver in (LinuxDriver, HeadlessDriver):
        yield from make(driver).__mro__


def module_name(path: Path) -> str:
    """The dotted name of a module of the project."""
    parts = [tui.__name__, *path.relative_to(PACKAGE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def in_project() -> tuple[tuple[str, Use], ...]:
    """Every use of a private part of Textual in the project, with the module's path."""
    return tuple(
        (path.relative_to(PACKAGE).as_posix(), use)
        for path in sorted(PACKAGE.rglob("*.py"))
        for use in uses(
            path.read_text(encoding="utf-8"), bases_in_project().get(module_name(path), {})
        )
    )
