"""Results as text, and the texts that tests compare with: sections of a file beside the test.

After an intended change, `python -m tests.recorded` writes these files again; with a word, only
those of modules with it in their names. Read the differences before you commit them: a person will
see them.
"""

from __future__ import annotations

import dataclasses
import importlib
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from decimal import Decimal
from pathlib import Path
from typing import Any

import msgspec

from tui.drive.errors import DriveError

AFTER_A_CHANGE = (
    "If the change is intended, run python -m tests.recorded, and read the differences."
)


def sections(path: Path) -> dict[str, str]:
    """The text of each section of a file; a line `== NAME` begins one."""
    parts = path.read_text("utf-8").split("\n== ")
    return {name: text for name, _, text in (part.partition("\n") for part in parts[1:])}


def write_sections(path: Path, found: Iterable[Callable[[], Iterable[str]]]) -> None:
    """Write what each function returns now."""
    texts = (f"\n== {each.__name__}\n" + "\n".join(each()) for each in found)
    path.write_text("".join(texts) + "\n== end\n", "utf-8")


def result(call: Callable[..., Any], *args: Any, **named: Any) -> str:
    """The result of a function, or its error, in short."""
    try:
        found = call(*args, **named)
    except DriveError as error:
        return f"{type(error).__name__}: {error}"
    return short(list(found) if isinstance(found, Iterator) else found)


def short(found: object) -> str:
    """A result in short: rows of a profile by their name, other objects by their fields."""
    match found:
        case msgspec.Struct():
            names = (getattr(found, name, "") for name in ("code", "id", "parameter", "name"))
            return f"<{next(filter(None, names), type(found).__name__)}>"
        case list() | tuple():
            return f"[{', '.join(map(short, found))}]"
        case set() | frozenset():
            return short(sorted(found))
        case dict():
            return f"{{{', '.join(f'{key}: {short(item)}' for key, item in found.items())}}}"
        case Decimal():
            return str(found)
    if dataclasses.is_dataclass(found) and not isinstance(found, type):
        parts = (getattr(found, field.name) for field in dataclasses.fields(found))
        return f"{type(found).__name__}({', '.join(map(short, parts))})"
    return repr(found)


def filled(found: Any) -> str:
    """The fields of an object that are not empty."""
    if dataclasses.is_dataclass(found):
        names = [field.name for field in dataclasses.fields(found)]
    elif not (names := list(getattr(found, "_fields", ()))):
        return f"{found}"
    values = {name: getattr(found, name) for name in names}
    shown = {name: value for name, value in values.items() if value and value != (0, 0)}
    return ", ".join(f"{name} {_plain(value)}" for name, value in shown.items())


def _plain(value: object) -> str:
    if isinstance(value, frozenset):
        return f"{sorted(value)}"
    return f"{value:.2f}" if isinstance(value, float) else f"{value}"


def recorded_modules() -> Iterator[str]:
    """Yield the names of tests with `SECTIONS`, and the path of their file in `TEXTS`.

    Those of the source itself are first: what they record are variables before any use.
    """
    folder = Path(__file__).parent
    for path in sorted(folder.rglob("test_*.py"), key=lambda path: (len(path.parts), path)):
        text = path.read_text("utf-8")
        if "\nSECTIONS" in text and "\nTEXTS" in text:
            yield ".".join(path.relative_to(folder.parent).with_suffix("").parts)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        own = {f"DRIVEPANEL_{name}": f"{folder}/{name}" for name in ("CONFIG", "STATE")}
        os.environ.update(own, HOME=folder, TZ="UTC", LC_ALL="C.UTF-8", DRIVEPANEL_RECORD="off")
        time.tzset()
        for name in recorded_modules():
            if all(word in name for word in sys.argv[1:]):
                module = importlib.import_module(name)
                write_sections(module.TEXTS, module.SECTIONS)
    importlib.import_module("tests.drive.test_whole_profile").write_faults()
