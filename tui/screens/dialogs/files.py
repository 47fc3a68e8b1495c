"""Names of files, as they are typed into a dialog."""

from __future__ import annotations

from pathlib import Path


def fault_of_new(name: str) -> str:
    """Return the error in a name for a new file, or nothing."""
    if not name.strip():
        return "A name is needed."
    if not name.isprintable():
        return "A name has no control characters."
    try:
        return f"{name} already exists." if Path(name).expanduser().exists() else ""
    except OSError as error:  # too long, or below a folder that may not be looked into
        return f"No file can be made there: {error.strerror or error}."
    except RuntimeError:
        return f"There is no home folder of {name.partition('/')[0]}."
