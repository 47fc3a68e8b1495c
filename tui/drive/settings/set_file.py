"""Parameter set files: written completely or not at all, never over another file by default."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from ..profile import library
from ..small_file import read_small_text
from .parameter_set import ParameterSet, SetError
from .set_reading import load_set

USUAL_FILE_MODE, PRIVATE_FILE_MODE = 0o666, 0o600


class FileThere(SetError):
    """A file with this name already exists, and overwriting it was not requested."""


def read_set(path: Path, name: str = "") -> ParameterSet:
    """Read a parameter set; raises SetError, UnknownProfile and ProfileError.

    `name` is what errors call the file, its path unless given.
    """
    name = name or str(path)
    try:
        text = read_small_text(path)
    except OSError as error:
        raise SetError(f"{name}: cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise SetError(
            f"{name}: byte {error.start} is not UTF-8 text: no parameter set."
        ) from error
    return load_set(text, name, library.load)


def write_file(
    path: Path, content: str | bytes, *, force: bool = False, private: bool = False
) -> None:
    """Write a file so that it is there whole, on the disk, or as it was before.

    A `private` file is for its owner alone. Raises FileThere where the file exists and `force` is
    not given, SetError where the folder does not take it.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    mode = PRIVATE_FILE_MODE if private else USUAL_FILE_MODE
    if not force and path.exists():
        raise FileThere(
            f"{path} already exists. Choose another name, or use --force to replace it."
        )
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(part, flags, mode), "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        _put(part, path, force=force)
        _sync_folder(path.parent)
    except OSError as error:
        raise SetError(f"{path}: cannot be written: {error.strerror or error}.") from error
    finally:
        with suppress(OSError):
            part.unlink()


def _put(part: Path, path: Path, *, force: bool) -> None:
    """Give the file its name; without `force`, fail atomically if the name is in use."""
    if force:
        part.replace(path)
        return
    try:
        os.link(part, path)
    except FileExistsError as error:
        raise FileThere(
            f"{path} already exists. Choose another name, or use --force to replace it."
        ) from error
    except (OSError, NotImplementedError):
        # a file system without links; the name was free at the check before
        part.replace(path)


def _sync_folder(folder: Path) -> None:
    """Flush the folder to disk, so that the name survives a power loss, if supported."""
    if os.name != "posix":
        return
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
