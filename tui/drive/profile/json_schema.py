"""The JSON Schema of a profile, for editors that complete and check TOML.

`python -m tui.drive.profile.json_schema` prints it; the committed copy is
profiles/profile.schema.json.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import msgspec

from .field_texts import field_text
from .schema import ProfileData


def profile_schema() -> dict[str, Any]:
    """The schema as a dictionary, generated from the structs that profiles are decoded into."""
    (reference,), parts = msgspec.json.schema_components(
        [ProfileData], ref_template="#/$defs/{name}"
    )
    for table, part in parts.items():
        for field, shape in part.get("properties", {}).items():
            if text := field_text(table, field):
                shape["description"] = text
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Drive Panel profile",
        **reference,
        "$defs": dict(sorted(parts.items())),
    }


def schema_text() -> str:
    """The schema as it is committed."""
    return json.dumps(profile_schema(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text())
