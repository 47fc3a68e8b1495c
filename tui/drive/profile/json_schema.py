"""JSON Schema of a profile, for editors that complete and check TOML.

`python -m tui.drive.profile.json_schema` prints it; with `help` or `search`, that of another file.
The committed copies are in the folder `profiles`. A field is described where it is defined,
else by a text of this module for its name.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any

import msgspec

from .schema import FamilySearch, HelpData, ProfileData, ProfileEvidence, Table

COMMON: Mapping[str, str] = {
    "id": "Identifier inside the profile, in lower case.",
    "name": "Short name for display.",
    "code": "Code as on the drive's keypad and in its manual.",
    "raw": "Raw value as sent on the line.",
    "parameter": "Code of a parameter of this profile.",
    "note": "Further information for the reader.",
    "source": "Id of the source and the place in it.",
    "confidence": "Certainty of the fact.",
    "remedy": "Remedy.",
    "mask": "Bits of the word that are evaluated.",
    "shift": "Bits by which the word is first shifted right.",
    "bit": "Number of the bit, 0 to 15.",
}
"""Texts of fields that mean the same in every table; a table may have its own."""

SCHEMA_FORMS: dict[str, tuple[type[Table], str]] = {
    "profile": (ProfileData, "Drive Panel profile"),
    "help": (HelpData, "Drive Panel help of faults"),
    "search": (FamilySearch, "Drive Panel words of a search"),
    "evidence": (ProfileEvidence, "Drive Panel evidence about a profile"),
}
"""The forms of files and their titles."""


def profile_schema(form: str = "profile") -> dict[str, Any]:
    """Return the schema as a dictionary, made from the structs into which files are decoded."""
    kind, title = SCHEMA_FORMS[form]
    (reference,), parts = msgspec.json.schema_components([kind], ref_template="#/$defs/{name}")
    for part in parts.values():
        for field, shape in part.get("properties", {}).items():
            if text := COMMON.get(field):
                shape.setdefault("description", text)
    if (parameter := parts.get("Parameter")) is not None:
        # a file may have a rule instead, or leave it to the group or the profile
        place = parameter["properties"]["address"]
        parameter["properties"]["address"] = {
            "anyOf": [
                {key: place[key] for key in place if key != "description"},
                {"type": "string"},
            ],
            "description": place["description"],
        }
        parameter["required"].remove("address")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **reference,
        "$defs": dict(sorted(parts.items())),
    }


def schema_text(form: str = "profile") -> str:
    return json.dumps(profile_schema(form), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text(*sys.argv[1:2]))
