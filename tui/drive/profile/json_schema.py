"""The JSON Schema of a profile, for editors that complete and check TOML.

`python -m tui.drive.profile.json_schema` prints it, with `help` or `search` that of another file.
The committed copies are in the folder `profiles`.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import msgspec

from .field_texts import field_text
from .schema import FamilySearch, HelpData, ProfileData, Table

SCHEMA_FORMS: dict[str, tuple[type[Table], str]] = {
    "profile": (ProfileData, "Drive Panel profile"),
    "help": (HelpData, "Drive Panel help of faults"),
    "search": (FamilySearch, "Drive Panel words of a search"),
}
"""The forms of files and their titles."""


def profile_schema(form: str = "profile") -> dict[str, Any]:
    """The schema as a dictionary, generated from the structs that files are decoded into."""
    kind, title = SCHEMA_FORMS[form]
    (reference,), parts = msgspec.json.schema_components([kind], ref_template="#/$defs/{name}")
    for table, part in parts.items():
        for field, shape in part.get("properties", {}).items():
            if text := field_text(table, field):
                shape["description"] = text
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **reference,
        "$defs": dict(sorted(parts.items())),
    }


def schema_text(form: str = "profile") -> str:
    """The schema as it is committed."""
    return json.dumps(profile_schema(form), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text(*sys.argv[1:2]))
