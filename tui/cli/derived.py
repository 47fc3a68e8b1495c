"""Everything that is made from the registrations of the commands.

`python -m tui.cli.derived` writes it: the index of commands, the manual page, the JSON Schemas, and
the table of commands in docs/cli.md. Tests compare each.

Fields of the schema are added, never renamed, while `schema` stays 1. It describes output: a field
is required unless it may be missing.
"""

from __future__ import annotations

import importlib
import json
import pkgutil
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import msgspec

import tui
from tui import cli
from tui.drive.profile.evidence import all_evidence
from tui.drive.profile.library import submitted_folder
from tui.drive.profile.schema import EvidenceResult, ProfileEvidence, Table
from tui.drive.small_file import read_small_text
from tui.session.acceptance.step_file import STEPS_KEY
from tui.session.acceptance.steps import MOST_STEPS, STEP_KINDS, AcceptanceTest
from tui.session.line_plan.plan_file import plant_schema

from . import commands
from .command_index import COMMANDS
from .documents.document import Document
from .main import main
from .shared.registration import GROUPS, RegisteredCommand


def acceptance_schema() -> str:
    """Return the schema as text, made from the tables into which a file is decoded."""
    tables: list[type[Table]] = [AcceptanceTest, *STEP_KINDS.values()]
    _, parts = msgspec.json.schema_components(tables, ref_template="#/$defs/{name}")
    for kind, form in STEP_KINDS.items():
        parts[form.__name__]["properties"]["kind"] = {"const": kind}
    whole: dict[str, Any] = parts.pop(AcceptanceTest.__name__)
    choices = [{"$ref": f"#/$defs/{form.__name__}"} for form in STEP_KINDS.values()]
    whole["properties"][STEPS_KEY] = {
        "type": "array", "minItems": 1, "maxItems": MOST_STEPS, "items": {"oneOf": choices}
    }  # fmt: skip
    whole["required"] = [*whole["required"], STEPS_KEY]
    # equal bounds of two tables may be kept as 0 or 0.0
    whole, parts = _whole_numbers(whole), _whole_numbers(parts)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps({**head, **whole, "$defs": dict(sorted(parts.items()))}, indent=2) + "\n"


def _whole_numbers(value: Any) -> Any:
    """Return a value of JSON with 1 for 1.0."""
    if isinstance(value, dict):
        return {key: _whole_numbers(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_whole_numbers(part) for part in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


NAME = "drivepanel"
_LINE_HELP, _, _STATUSES = (main.epilog or "").partition("Exit status:")

FILES = (
    ("$XDG_CONFIG_HOME/drivepanel/settings.toml", "Names of lines; the record on or off."),
    ("$XDG_CONFIG_HOME/drivepanel/profiles/", "Profiles of your own."),
    ("$XDG_CONFIG_HOME/drivepanel/evidence/", "Evidence about profiles from drives of this site."),
    ("$XDG_STATE_HOME/drivepanel/journal.jsonl", "The journal of writes to drives."),
    ("$XDG_STATE_HOME/drivepanel/record/", "The records of lines, one file for each day."),
    ("$XDG_STATE_HOME/drivepanel/drivepanel.log", "The log."),
)
VARIABLES = (
    ("DRIVEPANEL_LINE", "The default LINE, or its name."),
    ("DRIVEPANEL_CONFIG", "The configuration folder (default: in $XDG_CONFIG_HOME)."),
    ("DRIVEPANEL_STATE", "The state folder (default: in $XDG_STATE_HOME)."),
    ("DRIVEPANEL_MQTT_PASSWORD", "The password for the MQTT broker of serve and publish."),
    ("DRIVEPANEL_RECORD", "Turn the record of lines on or off (default: settings.toml)."),
    ("NO_COLOR", "Draw without colors."),
)
CAUTION = (
    "The panel is not a safety device: use the emergency stop of the machine. Run commands turn"
    " motors. Nothing is written without --arm, except for stops, which do not need it."
)


def man_page() -> str:
    """The whole page, as roff with the macros of man(7)."""
    top = click.Context(main, info_name=NAME, **main.context_settings)
    panel = main.get_command(top, "panel")
    assert panel is not None
    parts = [
        f'.TH {NAME.upper()} 1 "" "{NAME} {tui.__version__}" "User Commands"',
        *_section("NAME", f"{NAME} \\- {_text('panel and commands for drives on a Modbus line')}"),
        *_section("SYNOPSIS", *_usage(NAME, "[OPTIONS] [LINE [-d ADDRESS]]")),
        *_usage(NAME, "COMMAND [OPTIONS] ..."),
        *_section("DESCRIPTION", *_paragraphs(main.help or "")),
        ".PP",
        *_paragraphs(_LINE_HELP),
        *_section("OPTIONS", *_options(main, top)),
        *_section("OPTIONS OF THE PANEL", *_options(panel, top)),
        *_section("COMMANDS"),
    ]
    for name in main.list_commands(top):
        parts += _command(name, top)
    parts += _section("EXIT STATUS", *_statuses())
    parts += _section("ENVIRONMENT", *_list(VARIABLES))
    parts += _section("FILES", *_list(FILES))
    parts += _section("CAUTION", *_paragraphs(CAUTION))
    return "\n".join(parts) + "\n"


def _command(name: str, top: click.Context) -> Iterator[str]:
    command = main.get_command(top, name)
    assert command is not None
    context = click.Context(command, info_name=name, parent=top)
    usage = " ".join(command.collect_usage_pieces(context))
    yield f".SS {_text(name)}"
    yield from _usage(f"{NAME} {name}", usage)
    yield ".PP"
    yield from _paragraphs(command.help or "")
    yield from _options(command, context)
    if isinstance(command, RegisteredCommand):
        yield ".PP"
        yield _text(f"Exit status: {', '.join(map(str, command.all_statuses))}.")


def _usage(command: str, arguments: str) -> Iterator[str]:
    yield f".B {_text(command)}"
    yield _text(arguments)
    yield ".br"


def _options(command: click.Command, context: click.Context) -> Iterator[str]:
    records = (param.get_help_record(context) for param in command.get_params(context))
    return _list([record for record in records if record is not None and record[1]])


def _list(rows: list[tuple[str, str]] | tuple[tuple[str, str], ...]) -> Iterator[str]:
    for name, about in rows:
        yield ".TP"
        yield f".B {_text(name)}"
        yield _text(" ".join(about.split()))


def _statuses() -> Iterator[str]:
    """The table of the epilog, a status each; unchanged except in a table."""
    rows = re.findall(r"^\s*(\d+)\s+(.+)$", _STATUSES, re.MULTILINE)
    return _list(rows) if len(rows) > 1 else _paragraphs(_STATUSES)


def _section(title: str, *lines: str) -> list[str]:
    return [f".SH {title}", *lines]


def _paragraphs(text: str) -> Iterator[str]:
    r"""Texts of click: paragraphs separated by blank lines, one that begins with \b unchanged."""
    for number, part in enumerate(re.split(r"\n\s*\n", text.strip())):
        if number:
            yield ".PP"
        if part.lstrip().startswith("\b"):
            rows = part.lstrip().removeprefix("\b").strip("\n").split("\n")
            yield from (".nf", *(_text(row) for row in rows), ".fi")
        else:
            yield _text(" ".join(part.split()))


def _text(text: str) -> str:
    """A text that roff takes as it is."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("\b", "")
    return f"\\&{text}" if text.startswith((".", "'")) else text


def documents() -> tuple[type[Document], ...]:
    """Every document of every command, by command and name."""
    for package in ("documents", "commands"):
        folder = importlib.import_module(f"{cli.__name__}.{package}")
        for module in pkgutil.iter_modules(folder.__path__):
            importlib.import_module(f"{folder.__name__}.{module.name}")
    forms = [form for form in _subclasses(Document) if not form.__subclasses__()]
    return tuple(sorted(forms, key=lambda form: (commands_of(form), form.__name__)))


def commands_of(form: type[Document]) -> tuple[str, ...]:
    """The commands that print a document; empty if every command may."""
    field = next(f for f in msgspec.structs.fields(form) if f.name == "command")
    found: tuple[str, ...] = getattr(msgspec.inspect.type_info(field.type), "values", ())
    return tuple(sorted(found))


def _subclasses(form: type[Document]) -> list[type[Document]]:
    return [each for sub in form.__subclasses__() for each in (sub, *_subclasses(sub))]


def documents_schema() -> str:
    """The JSON Schema of all that is printed, as it is committed."""
    forms = documents()
    references, parts = msgspec.json.schema_components(forms, ref_template="#/$defs/{name}")
    for part in parts.values():
        _require_printed(part)
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Drive Panel, --json",
        "anyOf": [*references, {"type": "array", "items": {"anyOf": list(references)}}],
        "$defs": dict(sorted(parts.items())),
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _require_printed(part: dict[str, Any]) -> None:
    """Require the fields with a fixed value too: a default in a document is always printed."""
    fields: dict[str, Any] = part.get("properties", {})
    fixed = [name for name, field in fields.items() if "default" in field]
    for name in fixed:
        del fields[name]["default"]
    if fixed:
        part["required"] = [name for name in fields if name in fixed or name in part["required"]]


CLI = Path(__file__).parent
DOCS = CLI.parents[1] / "docs"
INDEX_HEAD = '''"""Commands by name, each with its module, its heading and its line of help.

Made by `python -m tui.cli.derived`.
"""

from __future__ import annotations

COMMANDS: dict[str, tuple[str, str, str]] = {
'''
COMMAND_TABLE = re.compile(r"(<!-- commands -->\n).*?(<!-- end of commands -->)", re.DOTALL)


def registered() -> dict[str, RegisteredCommand]:
    """Every command by its name, hidden ones included; imports all their modules."""
    names = sorted(module.name for module in pkgutil.iter_modules(commands.__path__))
    modules = [importlib.import_module(f"{commands.__name__}.{name}") for name in names]
    found = [
        item
        for module in modules
        for item in vars(module).values()
        if isinstance(item, RegisteredCommand) and _module(item) == module.__name__
    ]
    return {item.name or "": item for item in sorted(found, key=lambda item: item.name or "")}


def _module(command: RegisteredCommand) -> str:
    return command.callback.__module__


def index() -> dict[str, tuple[str, str, str]]:
    """Module, heading and line of help of each command that is listed."""
    return {
        name: (
            _module(command).rpartition(".")[2],
            command.group or GROUPS[-1],
            command.short_help or "",
        )
        for name, command in registered().items()
        if not command.hidden
    }


def command_index() -> str:
    """The module `command_index`, so that the help and a completion import no command."""
    rows = (
        f"    {_quoted(name)}: ({_quoted(module)}, {_quoted(group)}, {_quoted(summary)}),\n"
        for name, (module, group, summary) in index().items()
    )
    return f"{INDEX_HEAD}{''.join(rows)}}}\n"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def with_table(page: str) -> str:
    """The page docs/cli.md with the table of commands as they are registered."""
    return COMMAND_TABLE.sub(lambda found: f"{found[1]}{_table()}{found[2]}", page)


def _table() -> str:
    forms = [(commands_of(form), form.__name__) for form in documents()]
    rows = []
    for name, command in registered().items():
        if not command.hidden:
            printed = ", ".join(f"`{form}`" for by, form in forms if name in by)
            statuses = ", ".join(map(str, command.all_statuses))
            link = f"[{name}](#{_anchor(name)})"
            rows.append(f"| {link} | {command.short_help} | {statuses} | {printed} |")
    head = ["", "| command | purpose | exit statuses | JSON |", "|---|---|---|---|"]
    return "\n".join([*head, *rows, "", ""])


CONFIRMED_TABLE = re.compile(r"(<!-- confirmed -->\n).*?(<!-- end of confirmed -->)", re.DOTALL)


def with_confirmed(page: str, folder: Path) -> str:
    """The page docs/confirmed.md with the evidence of a folder; only real drives count."""
    found = [each for each in all_evidence(folder) if each.tested.kind == "drive"]
    head = ["", "| profile | drive | firmware | tested on | values compared | contradicted |"]
    head.append("|---|---|---|---|---|---|")
    rows = [
        f"| {_cell(each.profile)} | {_cell(each.tested.reference)} | {_cell(each.tested.firmware)}"
        f" | {_cell(each.date[:10])}, {_cell(each.tested.link)}"
        f" | {_names(each, 'confirmed', 'value')} | {_names(each, 'contradicted')} |"
        for each in found
    ]
    text = "\n".join([*head, *rows] if rows else ["", "No drive was confirmed yet."])
    return CONFIRMED_TABLE.sub(lambda old: f"{old[1]}{text}\n\n{old[2]}", page)


def _names(evidence: ProfileEvidence, result: EvidenceResult, subject: str = "") -> str:
    """The findings with a result, for a cell."""
    found = [f for f in evidence.findings if f.result == result and subject in ("", f.subject)]
    return ", ".join(_cell(f.name or f.subject) for f in found)


def _cell(text: str) -> str:
    """A text of a file, which is never markup, for a cell of a table."""
    return re.sub(r"[|\\`<>*_\[\]\n]", " ", text)


def _anchor(name: str) -> str:
    """The section of a command; some have one together."""
    heads = re.findall(r"^## (.+)$", read_small_text(DOCS / "cli.md"), re.MULTILINE)
    head = next((head for head in heads if name in head.split(", ")), "the-panel")
    return head.lower().replace(",", "").replace(" ", "-")


def write_derived() -> None:
    """Write every file that is made from the registrations."""
    found = index()
    COMMANDS.clear()
    COMMANDS.update(found)  # for the manual page: a command may be new
    page = read_small_text(DOCS / "cli.md")
    for path, text in (
        (CLI / "command_index.py", command_index()),
        (DOCS / "cli.schema.json", documents_schema()),
        (DOCS / "drivepanel.1", man_page()),
        (DOCS / "acceptance" / "acceptance.schema.json", acceptance_schema()),
        (DOCS / "plan" / "plan.schema.json", plant_schema()),
        (DOCS / "cli.md", with_table(page)),
        (
            DOCS / "confirmed.md",
            with_confirmed(read_small_text(DOCS / "confirmed.md"), submitted_folder()),
        ),
    ):
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_derived()
