"""Finds what can be changed in a module by one small defect, and changes it by its position.

Left as it is: docstrings, annotations, what only type checkers read, and the texts of `__all__`.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

FLIPPED: Mapping[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("boundary", "<="),
    ast.LtE: ("boundary", "<"),
    ast.Gt: ("boundary", ">="),
    ast.GtE: ("boundary", ">"),
    ast.Eq: ("condition", "!="),
    ast.NotEq: ("condition", "=="),
    ast.Is: ("condition", "is not"),
    ast.IsNot: ("condition", "is"),
    ast.In: ("condition", "not in"),
    ast.NotIn: ("condition", "in"),
}
"""By each comparison: the kind of defect, and the comparison in its place."""
SPELLED: Mapping[type[ast.cmpop], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.Is: "is", ast.IsNot: "is not", ast.In: "in", ast.NotIn: "not in",
}  # fmt: skip
FOR_TYPES = {"cast", "TypeVar", "NewType", "ParamSpec", "dataclass", "overload", "Literal"}
"""Names whose arguments or items change nothing that runs."""
SYMMETRIC = {"max", "min", "isclose", "gcd", "suppress"}
"""Functions whose result does not depend on the order of their arguments."""
KINDS = (
    "condition", "boundary", "constant", "text", "argument", "call", "await", "lock", "raise",
    "return",
)  # fmt: skip


class Change(NamedTuple):
    """One defect: a piece of a module, in bytes from its start, and its replacement."""

    kind: str
    start: int
    end: int
    new: str


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one module."""

    path: str
    """Relative to the checkout."""
    function: str
    """The qualified name of the outermost function around it, else of the class, else empty."""
    change: Change
    old: str
    number: int
    """Counts changes of a function that read alike, from 1."""
    line: int
    lines: tuple[range, ...]
    """Lines whose tests may notice it, the nearest first; empty if it runs at import."""
    names: tuple[str, ...]
    """If it runs at import: the names through which it has its effect."""

    @property
    def identity(self) -> str:
        """The same as long as its function is, wherever that moves in the module."""
        count = f" #{self.number}" if self.number > 1 else ""
        return f"{self.path}:{self.function}: {_reads(self.change, self.old)}{count}"

    def apply(self, source: str) -> str:
        """The module with the defect."""
        whole = source.encode()
        return (
            whole[: self.change.start] + self.change.new.encode() + whole[self.change.end :]
        ).decode()


@dataclass(frozen=True, slots=True)
class Site:
    """One node of a module, and the ways to change it."""

    mutants: tuple[Mutant, ...]


class Defaults:
    """By the name of a function or class: which parameters may be omitted."""

    def __init__(self, trees: Iterable[ast.Module]) -> None:
        self._optional: dict[str, set[str]] = {}
        self._order: dict[str, list[str]] = {}
        for tree in trees:
            for node in ast.walk(tree):
                match node:
                    case ast.FunctionDef() | ast.AsyncFunctionDef():
                        self._add(node.name, node.args)
                    case ast.ClassDef():
                        self._add_class(node)

    def _add(self, name: str, parameters: ast.arguments) -> None:
        plain = [parameter.arg for parameter in (*parameters.posonlyargs, *parameters.args)]
        with_default = plain[len(plain) - len(parameters.defaults) :]
        named = [
            parameter.arg
            for parameter, default in zip(
                parameters.kwonlyargs, parameters.kw_defaults, strict=True
            )
            if default is not None
        ]
        self._optional.setdefault(name, set()).update(with_default, named)
        self._order.setdefault(
            name, [parameter for parameter in plain if parameter not in ("self", "cls")]
        )

    def _add_class(self, node: ast.ClassDef) -> None:
        fields = [part for part in node.body if isinstance(part, ast.AnnAssign)]
        names = [part.target.id for part in fields if isinstance(part.target, ast.Name)]
        optional = {
            part.target.id
            for part in fields
            if part.value is not None and isinstance(part.target, ast.Name)
        }
        for part in node.body:
            if isinstance(part, ast.FunctionDef) and part.name == "__init__":
                self._add(node.name, part.args)
                return
        self._optional.setdefault(node.name, set()).update(optional)
        self._order.setdefault(node.name, names)

    def may_omit(self, name: str, parameter: str) -> bool:
        """True if a call without it is valid, as far as is known."""
        return name not in self._optional or parameter in self._optional[name]

    def may_omit_at(self, name: str, position: int) -> bool:
        """The same for a positional argument; False for a function of others."""
        order = self._order.get(name, [])
        return position < len(order) and order[position] in self._optional[name]


@dataclass(slots=True)
class _Surroundings:
    """Position of the walk through a module."""

    function: str = ""
    in_function: bool = False
    statement: ast.stmt | None = None
    body: range = field(default_factory=lambda: range(0))
    """Lines of the function around."""
    names: tuple[str, ...] = ()
    returns: str = ""
    is_boolean: bool = False
    """True if the value of the expression is used as a condition only."""


class Mutator:
    """Finds the sites of one module."""

    def __init__(self, path: str, source: str, defaults: Defaults) -> None:
        self._path = path
        self._source = source.encode()
        self._defaults = defaults
        self._starts = [0]
        for line in self._source.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))
        self._seen: Counter[str] = Counter()

    def sites(self) -> list[Site]:
        """All nodes that can be changed, in the order of the module."""
        found: list[Site] = []
        for node, around in self._walk(ast.parse(self._source), _Surroundings()):
            mutants = tuple(
                self._mutant(change, node, around)
                for change in self._changes(node, around)
                if self._source[change.start : change.end].decode() != change.new
            )
            if mutants:
                found.append(Site(mutants))
        return found

    def _mutant(self, change: Change, node: ast.AST, around: _Surroundings) -> Mutant:
        old = self._source[change.start : change.end].decode()
        # same text, same change, same function: distinguished by their number
        alike = f"{around.function}: {_reads(change, old)}"
        self._seen[alike] += 1
        lines: tuple[range, ...] = ()
        if around.in_function and around.statement is not None:
            own = _header(node) if isinstance(node, ast.stmt) else _lines(node)
            first = range(own.start, own.start + 1)
            lines = (first, own, _header(around.statement), around.body)
        elif around.in_function:
            lines = (around.body,)
        names = () if around.in_function else around.names
        line = self._source[: change.start].count(b"\n") + 1
        return Mutant(
            self._path, around.function, change, old, self._seen[alike], line, lines, names
        )

    # -- walking -------------------------------------------------------------------------------

    def _walk(
        self, node: ast.AST, around: _Surroundings
    ) -> Iterator[tuple[ast.AST, _Surroundings]]:
        if _is_only_read(node):
            return
        yield node, around
        if isinstance(node, ast.JoinedStr):
            return  # positions inside it are wrong before Python 3.12
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "type_params", "decorator_list"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from self._walk(child, self._inside(node, name, child, around))

    def _inside(
        self, node: ast.AST, name: str, child: ast.AST, around: _Surroundings
    ) -> _Surroundings:
        """The surroundings of a child in one field of a node."""
        made = _Surroundings(
            around.function, around.in_function, around.statement, around.body, around.names,
            around.returns, _is_condition(node, name, around),
        )  # fmt: skip
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef() if not around.in_function:
                made.function = f"{around.function}.{node.name}".lstrip(".")
                made.in_function = True
                made.statement = None  # defaults of parameters are evaluated at import
                made.body = range(node.body[0].lineno, (node.end_lineno or node.lineno) + 1)
                made.returns = ast.unparse(node.returns) if node.returns is not None else ""
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                made.returns = ast.unparse(node.returns) if node.returns is not None else ""
            case ast.ClassDef() if not around.in_function:
                made.function = f"{around.function}.{node.name}".lstrip(".")
                made.names = (node.name,)
            case ast.Lambda():
                made.returns = ""
        if isinstance(child, ast.stmt):
            made.statement = child
            if not made.in_function:
                made.names = tuple(_bound(child)) or made.names
        return made

    # -- changes -------------------------------------------------------------------------------

    def _changes(self, node: ast.AST, around: _Surroundings) -> Iterator[Change]:
        match node:
            case ast.Compare():
                yield from self._change_comparison(node)
            case ast.BoolOp():
                word = "or" if isinstance(node.op, ast.And) else "and"
                parts = f" {word} ".join(f"({self._text(value)})" for value in node.values)
                yield self._change("condition", node, f"({parts})")
            case ast.UnaryOp(op=ast.Not()):
                yield self._change("condition", node, f"bool({self._text(node.operand)})")
            case ast.Constant() if not around.is_boolean:
                yield from self._change_constant(node)
            case ast.JoinedStr():
                yield self._change("text", node, '""')
            case ast.Call():
                if around.is_boolean:
                    yield self._change("condition", node, f"(not {self._text(node)})")
                yield from self._change_arguments(node)
            case ast.Name() | ast.Attribute() | ast.NamedExpr() | ast.Await() if around.is_boolean:
                yield self._change("condition", node, f"(not ({self._text(node)}))")
            case ast.stmt():
                yield from self._change_statement(node, around)

    def _change_statement(self, node: ast.stmt, around: _Surroundings) -> Iterator[Change]:
        match node:
            case ast.Expr(value=ast.Call()):
                yield self._change("call", node, "pass")
            case ast.Expr(value=ast.Await()):
                yield self._change("await", node, "pass")
            case (
                ast.Assign(value=ast.Call() | ast.Await() as value)
                | ast.AnnAssign(value=ast.Call() | ast.Await() as value)
            ):
                yield self._change(
                    "call" if isinstance(value, ast.Call) else "await", value, "None"
                )
            case ast.With() | ast.AsyncWith():
                yield from self._change_lock(node)
            case ast.Raise():
                yield self._change("raise", node, "pass")
            case ast.Return():
                yield self._change_return(node, around.returns)

    def _change_comparison(self, node: ast.Compare) -> Iterator[Change]:
        texts = [f"{self._text(value)}" for value in (node.left, *node.comparators)]
        for changed, flipped in enumerate(node.ops):
            kind, new = FLIPPED[type(flipped)]
            parts = [texts[0]]
            for number, comparison in enumerate(node.ops):
                parts += [
                    new if number == changed else SPELLED[type(comparison)],
                    texts[number + 1],
                ]
            yield self._change(kind, node, f"({' '.join(parts)})")

    def _change_constant(self, node: ast.Constant) -> Iterator[Change]:
        value = node.value
        if isinstance(value, bool):
            yield self._change("constant", node, repr(not value))
        elif isinstance(value, int | float):
            if value:
                yield self._change("constant", node, repr(value * 10))
            if value and (isinstance(value, float) or value % 10 == 0):
                yield self._change(
                    "constant", node, repr(value / 10 if isinstance(value, float) else value // 10)
                )
            yield self._change("constant", node, repr(value + 1))
        elif isinstance(value, str | bytes) and value:
            yield self._change("text", node, '""' if isinstance(value, str) else 'b""')

    def _change_arguments(self, node: ast.Call) -> Iterator[Change]:
        name = (
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        )
        arguments = [self._text(argument) for argument in node.args]
        named = [self._text(argument) for argument in node.keywords]
        is_plain = not any(isinstance(argument, ast.Starred) for argument in node.args)
        has_order = is_plain and name not in SYMMETRIC
        for position in range(len(arguments) - 1) if has_order else ():
            swapped = arguments.copy()
            swapped[position : position + 2] = reversed(swapped[position : position + 2])
            if swapped != arguments:
                yield self._call(node, [*swapped, *named])
        last = len(arguments) - 1
        if is_plain and last >= 0 and self._defaults.may_omit_at(name, last):
            yield self._call(node, [*arguments[:-1], *named])
        for position, keyword in enumerate(node.keywords):
            if keyword.arg is not None and self._defaults.may_omit(name, keyword.arg):
                yield self._call(node, [*arguments, *named[:position], *named[position + 1 :]])

    def _call(self, node: ast.Call, arguments: list[str]) -> Change:
        return self._change("argument", node, f"{self._text(node.func)}({', '.join(arguments)})")

    def _change_lock(self, node: ast.With | ast.AsyncWith) -> Iterator[Change]:
        """A block entered through a name alone is guarded by a lock, or by what acts like one."""
        item = node.items[0]
        is_lock = isinstance(item.context_expr, ast.Name | ast.Attribute)
        if len(node.items) > 1 or not is_lock or item.optional_vars is not None:
            return
        begins, ends = self._offset(node.lineno, node.col_offset), self._span(item.context_expr)[1]
        before = self._source[begins : self._span(item.context_expr)[0]].split()
        if before[-1:] == [b"with"] and self._source[ends:].lstrip()[:1] == b":":
            yield Change("lock", begins, ends, "if True")

    def _change_return(self, node: ast.Return, returns: str) -> Change:
        if node.value is None:
            return self._change("return", node, "pass")
        text = self._text(node.value)
        constant = node.value.value if isinstance(node.value, ast.Constant) else ...
        if returns == "bool":
            new = repr(not constant) if isinstance(constant, bool) else f"not ({text})"
        elif returns in ("int", "float"):
            new = f"({text}) + 1"
        elif returns == "str":
            new = '"?"' if constant == "" else '""'
        else:
            new = "True" if constant is None else "None"
        return self._change("return", node, f"return {new}")

    # -- positions -----------------------------------------------------------------------------

    def _change(self, kind: str, node: ast.AST, new: str) -> Change:
        return Change(kind, *self._span(node), new)

    def _text(self, node: ast.AST) -> str:
        begins, ends = self._span(node)
        text = self._source[begins:ends].decode()
        # without the parentheses around it, which are not its own
        return f"({text})" if isinstance(node, ast.NamedExpr | ast.Lambda | ast.IfExp) else text

    def _span(self, node: ast.AST) -> tuple[int, int]:
        begins = self._offset(node.lineno, node.col_offset)  # type: ignore[attr-defined]
        ends = self._offset(node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]
        return begins, ends

    def _offset(self, line: int, column: int) -> int:
        return self._starts[line - 1] + column


def _reads(change: Change, old: str) -> str:
    """A change in one line."""
    before, after = (" ".join(text.split()) for text in (old, change.new))
    return f"{change.kind}: {before} -> {after}"


def _lines(node: ast.AST) -> range:
    return range(node.lineno, node.end_lineno + 1)  # type: ignore[attr-defined]


def _header(statement: ast.stmt) -> range:
    """The lines of a statement without those of its blocks."""
    blocks = getattr(statement, "body", None) or getattr(statement, "cases", None)
    if not blocks:
        return _lines(statement)
    first = blocks[0].pattern if isinstance(blocks[0], ast.match_case) else blocks[0]
    return range(statement.lineno, max(first.lineno, statement.lineno + 1))


def _is_only_read(node: ast.AST) -> bool:
    """True for what does nothing when it runs, or is there for type checkers."""
    match node:
        case ast.Expr(value=ast.Constant()) | ast.Import() | ast.ImportFrom():
            return True
        case ast.Raise(exc=ast.Name(id="NotImplementedError")):
            return True
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.If(test=ast.Compare(left=ast.Name(id="__name__"))):
            return True
        case ast.Assign(targets=[ast.Name(id="__all__" | "__slots__")]):
            return True
        case ast.keyword(arg="frozen" | "kw_only"):
            return True  # of a class: what a program does wrong by it, mypy finds
        case ast.Call(func=ast.Name(id=name)) | ast.Subscript(value=ast.Name(id=name)):
            return name in FOR_TYPES
    return False


def _is_condition(node: ast.AST, name: str, around: _Surroundings) -> bool:
    """True if the value of that field of a node is used as a condition only."""
    match node:
        case ast.If() | ast.While() | ast.IfExp() | ast.Assert():
            return name == "test"
        case ast.comprehension():
            return name == "ifs"
        case ast.match_case():
            return name == "guard"
        case ast.BoolOp():
            return around.is_boolean
    return False


def _bound(statement: ast.stmt) -> Iterator[str]:
    """The names that a statement binds at import."""
    match statement:
        case ast.Assign(targets=targets):
            for target in targets:
                yield from (node.id for node in ast.walk(target) if isinstance(node, ast.Name))
        case ast.AnnAssign(target=ast.Name(id=name)) | ast.AugAssign(target=ast.Name(id=name)):
            yield name
        case ast.ClassDef(name=name):
            yield name
