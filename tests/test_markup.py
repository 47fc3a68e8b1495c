"""No text of a person, a drive, a file or a profile is ever markup: checked in the whole code."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from .sources import PACKAGE, modules, nodes_of

TEXTS = PACKAGE / "widgets" / "plain.py"
"""The only module that makes labels and list entries, with markup off."""
FIELDS = PACKAGE / "widgets" / "fields.py"
PRINTS = {PACKAGE / "cli" / "shared" / "say.py", PACKAGE / "cli" / "shared" / "output.py"}
"""The modules that print for the commands and replace control characters."""
MADE_ELSEWHERE = {
    "Label": "Plain",
    "Static": "Plain",
    "Option": "entry",
    "Input": "Field or NumberInput",
    "MaskedInput": "Field or NumberInput",
    "TextArea": "Field",
    "RichLog": "Lines",
    "Log": "Lines",
    "Markdown": "Plain",
    "Button": "a key",
    "DataTable": "Lines",
    "Content": "Text",
}
"""Calls that Textual would read as markup or send unchanged, and their replacement."""
READ_AS_MARKUP = {"border_title", "border_subtitle", "tooltip"}
PRINTING = {
    "print", "echo", "secho", "click.echo", "click.secho",
    "sys.stdout.write", "sys.stderr.write", "sys.stdout.writelines", "sys.stderr.writelines",
}  # fmt: skip
PRINTS_THEMSELVES = (
    PACKAGE / "drive" / "profile" / "json_schema.py",
    PACKAGE / "cli" / "documents" / "json_schema.py",
    PACKAGE / "cli" / "man_page.py",
)
"""Modules that print only their own text, for a redirection."""
READS_ITSELF = {
    PACKAGE / "terminal" / "abilities.py",
    PACKAGE / "session" / "starts" / "processes.py",
}
"""Modules that read the system's own files, in /proc."""


def faults(nodes: Iterable[ast.AST], path: Path) -> Iterator[str]:
    """Yield calls in a module that could take a text for markup, or print it unchanged."""
    for node in nodes:
        if isinstance(node, ast.Call):
            yield from _call_texts(node, path)
        elif isinstance(node, ast.Attribute | ast.Name):
            name = node.attr if isinstance(node, ast.Attribute) else node.id
            if name in ("from_markup", "render_markup"):
                yield f"{name} reads markup"
        elif isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Attribute) and target.attr in READ_AS_MARKUP:
                    yield f"{target.attr} is read as markup"


def _call_texts(call: ast.Call, path: Path) -> Iterator[str]:
    name = _name(call.func)
    off = any(_is(k, "markup", value=False) for k in call.keywords)
    if any(k.arg == "markup" and not _is(k, "markup", value=False) for k in call.keywords):
        yield f"{name} with markup"
    if name in MADE_ELSEWHERE and path not in (TEXTS, FIELDS):
        yield f"{name}: take {MADE_ELSEWHERE[name]}"
    if name == "Console" and not off:
        yield "a console with markup"
    if _dotted(call.func) in PRINTING and path not in (*PRINTS, *PRINTS_THEMSELVES):
        yield f"{name}: take say"
    if name in ("read_text", "read_bytes") and path not in READS_ITSELF:
        yield f"{name} waits for a pipe, and takes files of any length: take read_small_text"
    if name in ("writerow", "writerows") and _name(call.args[0]) != "plain_cells":
        yield f"{name}: take plain_cells"
    if name == "add_row" and PACKAGE / "cli" not in path.parents:
        for cell in call.args:
            if not (isinstance(cell, ast.Constant) or _name(cell) in ("Text", "assemble")):
                yield "a cell that may be a str"


def _name(node: ast.expr) -> str:
    """Return the last name of the called object, or of its owner: `Text` of `Text.assemble(x)`."""
    if isinstance(node, ast.Call):
        node = node.func
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


def _dotted(node: ast.expr) -> str:
    """Return the dotted name of a call: `sys.stdout.write`; empty if it is more than a name."""
    if isinstance(node, ast.Attribute):
        return f"{before}.{node.attr}" if (before := _dotted(node.value)) else ""
    return node.id if isinstance(node, ast.Name) else ""


def _is(keyword: ast.keyword, name: str, *, value: bool) -> bool:
    return (
        keyword.arg == name
        and isinstance(keyword.value, ast.Constant)
        and keyword.value.value is value
    )


def parsed(source: str) -> Iterator[ast.AST]:
    return ast.walk(ast.parse(source))


def test_no_text_is_markup() -> None:
    found = {path: list(faults(nodes_of(path), path)) for path in modules()}
    assert len(found) > 300
    assert {path: what for path, what in found.items() if what} == {}


@pytest.mark.parametrize(
    "line",
    [
        'Label(f"{name}", id="x")',
        "widgets.Static(question)",
        "Option(drive.name)",
        "Input(value)",
        'app.notify("[b]", markup=True)',
        "Label('x', markup=flag)",
        "Text.from_markup(name)",
        "self.border_title = name",
        "rich.console.Console()",
        "Console(markup=True)",
        "click.echo(name)",
        "print(name)",
        "table.add_row(name)",
        "table.add_row(Text(code), f'{name}')",
        "sys.stdout.write(name)",
        "rows.writerow([name])",
        "path.read_text()",
    ],
)
def test_markup_fails_the_check(line: str) -> None:
    assert list(faults(parsed(line), PACKAGE / "screens" / "new.py"))


def test_correct_text_passes() -> None:
    assert list(faults(parsed("console().print(table)"), PACKAGE / "cli" / "new.py")) == []
    right = 'Plain(name); entry(Text(name)); table.add_row(Text(name), ""); app.notify(name)'
    assert list(faults(parsed(right), PACKAGE / "screens" / "new.py")) == []
    assert list(faults(parsed("rows.writerow(plain_cells(row))"), PACKAGE / "cli" / "new.py")) == []
