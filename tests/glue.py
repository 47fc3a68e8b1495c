"""Texts that are glued from pieces, found in the source.

A text that is translated must be a whole sentence with named placeholders. These forms break that,
and can be found reliably. `python -m tests.glue` lists them with file and line.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from .sources import ROOT, modules, tree_of, walked

COMPARING = re.compile(
    "remove(suf|pre)fix|(starts|ends)with|r?(split|partition)|replace|strip"
    "|compile|sub|(full)?match|search|findall"
)
"""Functions whose arguments are compared with a text, not put into one."""
CONTINUES = re.compile(r" \(?[a-z]+ \S|[,;] \S")
"""Beginning of two words or more that continue a sentence; a single word may be a label."""


class Glue(NamedTuple):
    """One glued text with its place."""

    path: str
    line: int
    form: str
    text: str


Form = Callable[[ast.AST], bool]


def _words(node: ast.AST) -> str:
    """Return the text of a literal, or of the literal parts of an f-string."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            return "".join(_words(part) or "\0" for part in parts)
    return ""


def _is_prose(text: str) -> bool:
    return re.search(r"[A-Za-z]{2,}", text) is not None


def _is_sentence_part(text: str) -> bool:
    return text == "." or (" " in text and _is_prose(text))


def _branches(value: ast.expr) -> Iterator[str]:
    match value:
        case ast.IfExp(body=body, orelse=orelse):
            yield from _branches(body)
            yield from _branches(orelse)
        case ast.BoolOp(values=values):
            for item in values[1:]:
                yield from _branches(item)
        case _:
            yield _words(value)


def changes_capital(node: ast.AST) -> bool:
    """Return True for `text[0].upper()` and `text[:1].lower()`."""
    match node:
        case ast.Call(
            func=ast.Attribute(
                attr="upper" | "lower",
                value=ast.Subscript(
                    slice=ast.Constant(value=0) | ast.Slice(lower=None, upper=ast.Constant(value=1))
                ),
            )
        ):
            return True
    return False


def switches_words(node: ast.AST) -> bool:
    """Return True for `f"{count} drive{'s' if count > 1 else ''}"`: words chosen inside a text."""
    if not isinstance(node, ast.JoinedStr) or not _is_prose(_words(node)):
        return False
    placeholders = [part.value for part in node.values if isinstance(part, ast.FormattedValue)]
    return any(
        isinstance(value, ast.IfExp) and any(re.search(r"[A-Za-z]", b) for b in _branches(value))
        for value in placeholders
    )


def adds_words(node: ast.AST) -> bool:
    """Return True for `text + " again"` and `text += " again"`, and for a full stop."""
    match node:
        case ast.BinOp(op=ast.Add(), left=left, right=right):
            return any(_is_sentence_part(_words(side)) for side in (left, right))
        case ast.AugAssign(op=ast.Add(), value=value):
            return any(_is_sentence_part(text) for text in _branches(value))
    return False


def strips_full_stop(node: ast.AST) -> bool:
    """Return True for `f"{text.rstrip('.')}."`."""
    match node:
        case ast.FormattedValue(
            value=ast.Call(func=ast.Attribute(attr="rstrip"), args=[ast.Constant(value=".")])
        ):
            return True
    return False


def joins_with_a_word(node: ast.AST) -> bool:
    """Return True for `" and ".join(names)`: `all_of` and `any_of` do that for all texts."""
    match node:
        case ast.Call(func=ast.Attribute(attr="join", value=ast.Constant(value=str(text)))):
            return text.strip() in ("and", "or")
    return False


FORMS: dict[str, Form] = {
    "capital": changes_capital,
    "switch": switches_words,
    "plus": adds_words,
    "full stop": strips_full_stop,
    "list": joins_with_a_word,
}


def _fragments(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield texts that begin inside a sentence: `", not all of which were asked"`."""
    apart = {id(inner) for node in walked(tree) for inner in _not_pieces(node)}
    for node in walked(tree):
        text = _words(node)
        is_text = isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in apart
        is_label = text.endswith(" ")  # with its margins
        if is_text and not is_label and CONTINUES.match(text) and _is_prose(text):
            yield node


def _not_pieces(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the literals that are parts of an f-string, documents, or arguments of a search."""
    match node:
        case ast.JoinedStr(values=parts):
            yield from parts
        case ast.Expr(value=ast.Constant() as document):
            yield document
        case ast.Call(func=ast.Attribute(attr=name, value=value), args=args):
            if COMPARING.fullmatch(name):
                yield from args
            if name == "join":
                yield value


def glued(tree: ast.Module, path: str) -> Iterator[Glue]:
    """Yield each glued text of a module."""
    for node in walked(tree):
        for form, found in FORMS.items():
            if found(node):
                yield Glue(path, node.lineno, form, ast.unparse(node))  # type: ignore[attr-defined]
    for node in _fragments(tree):
        yield Glue(path, node.lineno, "fragment", ast.unparse(node))  # type: ignore[attr-defined]


def all_glued() -> Iterator[Glue]:
    """Yield each glued text of the project."""
    for path in modules():
        yield from glued(tree_of(path), path.relative_to(ROOT).as_posix())


if __name__ == "__main__":
    for item in all_glued():
        print(f"{item.path}:{item.line}: {item.form}: {item.text[:150]}")
