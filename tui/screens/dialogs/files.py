"""Names of files, as they are typed into a dialog."""

from __future__ import annotations

from pathlib import Path


def fault_of_new(name: str) -> str:
    """What is wrong with a name for a new file, or nothing."""
    if not name.strip():
        return "A name is needed."
    return f"{name} is there already." if Path(name).expanduser().exists() else ""


def fault_of_known(name: str) -> str:
    """What is wrong with the name of a file to read, or nothing."""
    return "" if Path(name.strip()).expanduser().is_file() else f"There is no file {name}."
