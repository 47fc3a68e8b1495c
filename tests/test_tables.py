"""Constants, tables and default values of each module, compared with the recorded ones.

`tables.txt` has a section for each package. Numbers, names and the structure of tables are shown;
texts for people only as `…`, as other tests check their words. An empty one is shown as such.
"""

from __future__ import annotations

import ast
import dataclasses
import enum
import os
import re
import types
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from decimal import Decimal
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin
from zlib import crc32

import msgspec
import pytest
from rich.style import Style
from rich.text import Text

from tests.recorded import AFTER_A_CHANGE, sections
from tests.sources import PACKAGE, ROOT, modules, tree_of

_READERS = {"member_descriptor", "getset_descriptor", "property", "_tuplegetter", "cached_property"}
_LONGEST = 80
TEXTS = Path(__file__).with_name("tables.txt")
_NAME = re.compile(r"[\w.+,:/()*#@%~-]{1,30}")
_NOTHING = re.compile(r"[…\s,(){}\[\]:]*")


def shape(value: Any) -> str:
    """A value without the words of its texts."""
    match value:
        case enum.Enum():
            return f"{type(value).__name__}.{value.name}"
        case str():
            return value if _NAME.fullmatch(value) else "…" if value else '""'
        case bytes() if len(value) > _LONGEST:
            return f"{len(value)} bytes, {crc32(value)}"
        case None | bool() | int() | float() | bytes() | range() | Decimal() | msgspec.Meta():
            return repr(value)
        case os._Environ():
            return "environ"
        case Mapping():
            return f"{{{', '.join(f'{shape(key)}: {shape(item)}' for key, item in value.items())}}}"
        case tuple() | list():
            kind = type(value).__name__ if hasattr(value, "_fields") else ""
            return f"{kind}({_items(value)})"
        case set() | frozenset():
            return f"{{{', '.join(sorted(map(shape, value)))}}}"
    return _shape_of_object(value)


def _shape_of_object(value: Any) -> str:
    match value:
        case re.Pattern():
            return shape(value.pattern)
        case Text():
            return f"Text({shape(value.plain)}, {value.style})"
        case Style() | TypeVar():
            return str(value)
        case partial():
            return f"{shape(value.func)}({_items(value.args)}{shape(value.keywords)})"
        case type() if issubclass(value, enum.Enum):
            return f"{{{', '.join(f'{each.name}: {shape(each.value)}' for each in value)}}}"
        case type() | types.FunctionType():
            return value.__name__
    if origin := get_origin(value):
        return f"{getattr(origin, '__name__', origin)}[{_items(get_args(value))}]"
    if dataclasses.is_dataclass(value) or isinstance(value, msgspec.Struct):
        given = ((name, getattr(value, name, None)) for name, _ in _defaults(type(value)))
        return f"{type(value).__name__}({', '.join(f'{name}={shape(x)}' for name, x in given)})"
    if type(value).__name__ == "Factory":  # msgspec's, of a mutable default
        return f"{shape(value.factory)}()"
    return type(value).__name__


def _items(values: Any) -> str:
    return ", ".join(map(shape, values))


def _defaults(kind: Any) -> Iterator[tuple[str, Any]]:
    """Fields of a form with their default values, or what makes them."""
    if dataclasses.is_dataclass(kind):
        for field in dataclasses.fields(kind):
            made = field.default is dataclasses.MISSING
            yield field.name, field.default_factory if made else field.default
    else:
        names, given = kind.__struct_fields__, kind.__struct_defaults__
        yield from zip(
            names, [msgspec.NODEFAULT] * (len(names) - len(given)) + [*given], strict=True
        )


def _bound(body: list[ast.stmt]) -> Iterator[str]:
    """Names that statements bind."""
    for node in body:
        match node:
            case ast.Assign(targets=targets):
                names = (part for target in targets for part in ast.walk(target))
                yield from (part.id for part in names if isinstance(part, ast.Name))
            case ast.AnnAssign(target=ast.Name(id=name)) | ast.AugAssign(target=ast.Name(id=name)):
                yield name


def _function_defaults(
    body: list[ast.stmt], holder: Mapping[str, Any]
) -> Iterator[tuple[str, Any]]:
    """Functions with the default values of their parameters."""
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found = holder.get(node.name)
            found = getattr(found, "__func__", getattr(found, "fget", found))
            found = getattr(found, "__wrapped__", getattr(found, "callback", found))
            given = [*(getattr(found, "__defaults__", None) or ())]
            given += (getattr(found, "__kwdefaults__", None) or {}).values()
            yield node.name, given


def _class_values(kind: Any, body: list[ast.stmt]) -> Iterator[tuple[str, Any]]:
    """Fixed values of a class, its fields and methods."""
    if issubclass(kind, enum.Enum):
        yield "", kind
        return
    if dataclasses.is_dataclass(kind) or issubclass(kind, msgspec.Struct):
        missing = (dataclasses.MISSING, msgspec.NODEFAULT)
        yield from (each for each in _defaults(kind) if not any(each[1] is no for no in missing))
    fixed = (name for name in _bound(body) if name in vars(kind))
    yield from ((name, value) for name in fixed if not _is_slot(value := vars(kind)[name]))
    yield from _function_defaults(body, vars(kind))


def _is_slot(value: object) -> bool:
    """True for what reads a field: its name is that of the table already."""
    return type(value).__name__ in _READERS


def tables(package: str) -> Iterator[str]:
    """All that modules of a package fix when they are imported."""
    for path in modules(PACKAGE / package):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        module, body = vars(import_module(name)), tree_of(path).body
        found = [(each, module[each]) for each in _bound(body) if each in module]
        found = [(each, value) for each, value in found if not each.strip("_").islower()]
        found += _function_defaults(body, module)
        for node in body:
            if isinstance(node, ast.ClassDef) and isinstance(module.get(node.name), type):
                own = _class_values(module[node.name], node.body)
                found += ((f"{node.name}.{each}".rstrip("."), value) for each, value in own)
        shown = ((each, shape(value)) for each, value in found)
        yield from (
            f"{name}.{each} = {text}" for each, text in shown if not _NOTHING.fullmatch(text)
        )


PACKAGES = sorted(path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists())


def _section(package: str) -> Callable[[], Iterator[str]]:
    section = partial(tables, package)
    section.__name__ = package  # type: ignore[attr-defined]
    return section


SECTIONS = tuple(map(_section, PACKAGES))


def parts(rows: Iterable[str]) -> dict[str, Counter[str]]:
    """By each name: the parts of its value."""
    pairs = (row.partition(" = ") for row in rows)
    return {name: Counter(re.findall(r"[^\s,(){}\[\]=]+", text)) for name, _, text in pairs}


@pytest.mark.parametrize("package", PACKAGES)
def test_constants_and_tables_are_the_recorded_ones(package: str) -> None:
    """New names, and new rows of tables, need not be recorded at once."""
    found, recorded = parts(tables(package)), parts(sections(TEXTS)[package].splitlines())
    both = found.keys() & recorded.keys()
    gone = {name: recorded[name] - found[name] for name in both}
    # constants of texts alone are not recorded, unless one is empty
    texts = {name for name in found if name in recorded or name.rpartition(".")[2].isupper()}
    none: Counter[str] = Counter()
    emptied = {name for name in texts if found[name]['""'] > recorded.get(name, none)['""']}
    assert {name: list(missing) for name, missing in gone.items() if missing} == {}, AFTER_A_CHANGE
    assert emptied == set(), AFTER_A_CHANGE
    assert len(both) >= 0.9 * len(found), f"Too few are recorded. {AFTER_A_CHANGE}"
