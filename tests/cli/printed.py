"""The documents of an output, each compared with the JSON Schema field by field."""

from __future__ import annotations

import json
from functools import lru_cache
from typing import Any

import msgspec

from tui.cli.derived import commands_of
from tui.cli.derived import documents as all_forms
from tui.cli.documents.document import Document


@lru_cache(maxsize=1)
def forms() -> tuple[type[Document], ...]:
    return all_forms()


def form_of(document: dict[str, Any]) -> str:
    """The name of the form that a document has. Raises ValueError if none fits.

    A form fits if every field is listed, of its type, and no printed field is missing.
    """
    wrong = []
    for form in forms():
        if commands_of(form) and document.get("command") not in commands_of(form):
            continue
        try:
            found = msgspec.convert(document, form)
        except msgspec.ValidationError as error:
            wrong.append(f"{form.__name__}: {error}")
        else:
            if msgspec.to_builtins(found) == document:
                return form.__name__
            wrong.append(f"{form.__name__}: a field is missing")
    raise ValueError("; ".join(wrong))


def documents(text: str) -> list[dict[str, Any]]:
    """Each document of an output: one, a list of them, or one a line. Raises as `form_of`."""
    try:
        whole = json.loads(text)
    except ValueError:
        whole = [json.loads(line) for line in text.splitlines()]
    found: list[dict[str, Any]] = whole if isinstance(whole, list) else [whole]
    for document in found:
        form_of(document)
    return found


def forms_of(text: str) -> set[str]:
    """The names of the forms of an output; raises ValueError for a document without one."""
    return {form_of(document) for document in documents(text)}
