"""JSON Schema of a test file, for editors. `python -m tui.cli.derived` writes it."""

from __future__ import annotations

import json
from typing import Any

import msgspec

from tui.drive.profile.schema import Table

from .step_file import STEPS_KEY
from .steps import MOST_STEPS, STEP_KINDS, AcceptanceTest


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
