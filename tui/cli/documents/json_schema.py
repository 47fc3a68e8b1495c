"""The JSON Schema of what `--json` prints.

`python -m tui.cli.derived` writes it to docs/cli.schema.json. Fields are added, never renamed,
while `schema` stays 1. The schema describes output: a field is required unless it may be missing.
"""

from __future__ import annotations

import importlib
import json
import pkgutil
from typing import Any

import msgspec

from tui import cli

from .document import Document


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
