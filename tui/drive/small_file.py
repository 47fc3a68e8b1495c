"""Bounded reads of files that a person names or that Drive Panel stores, and complete writes.

A pipe would block its reader forever, and a device such as /dev/zero would fill the memory.
"""

from __future__ import annotations

import codecs
import errno
import os
import stat
from contextlib import suppress
from pathlib import Path

supplied: dict[Path, bytes] = {}
"""Content to read in place of a file, by path: what a command has read from standard input."""

NOT_SYNCED = frozenset({errno.EINVAL, errno.ENOTSUP})
"""Errors of file systems that cannot flush a folder; the file itself was flushed."""
LONGEST_TEXT = 2_000_000
"""Most bytes of a profile, a parameter set, a block file, or a file of Drive Panel."""


def open_regular(path: Path) -> int:
    """Open a file for reading; raises OSError, also if it is not a regular file."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)
    flags |= getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOCTTY", 0)
    handle = os.open(path, flags)
    mode = os.fstat(handle).st_mode
    if stat.S_ISREG(mode):
        return handle
    os.close(handle)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    raise OSError(errno.EINVAL, "it is not a regular file", str(path))


def read_small(path: Path, longest: int = LONGEST_TEXT) -> bytes:
    """Read a file. Raises OSError, also if it has more than `longest` bytes or is not a file."""
    if (data := supplied.get(path)) is None:
        with os.fdopen(open_regular(path), "rb") as file:
            data = file.read(longest + 1)
    if len(data) > longest:
        raise OSError(errno.EFBIG, f"it is longer than {longest // 1000} kB", str(path))
    return data


def read_small_text(path: Path, longest: int = LONGEST_TEXT) -> str:
    """Read a text file, with line ends as `\\n`. Raises OSError and UnicodeDecodeError."""
    return decoded_text(read_small(path, longest))


def decoded_text(data: bytes) -> str:
    """Decode a text, with line ends as `\\n`. Raises UnicodeDecodeError."""
    return data.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")


def replace_file(path: Path, data: bytes, *, flushed: bool = True) -> None:
    """Write a file completely or leave it unchanged; `flushed` to the disk. Raises OSError."""
    part = path.with_suffix(f".{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.write(data)
            if flushed:
                file.flush()
                os.fsync(file.fileno())
        part.replace(path)
        if flushed:
            sync_folder(path.parent)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder, if the system supports it. Raises OSError."""
    if os.name != "posix":
        return
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    except OSError as error:
        if error.errno not in NOT_SYNCED:
            raise
    finally:
        os.close(opened)


def encoding_fault(data: bytes) -> str:
    """Return the line of a text that is not plain UTF-8, and why; empty if it is.

    Line ends may be those of Windows.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "1: the file is UTF-16, not UTF-8. Save it as UTF-8 without a byte order mark (BOM)."
    if data.startswith(codecs.BOM_UTF8):
        return "1: the file begins with a byte order mark (BOM). Save it as UTF-8 without BOM."
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        byte, line = data[error.start], data.count(b"\n", 0, error.start) + 1
        sign = data[error.start : error.start + 1].decode("cp1252", errors="replace")
        return (
            f"{line}: byte 16#{byte:02X} is not UTF-8; in Latin-1 or Windows-1252 it is"
            f" {sign!r}. Save the file as UTF-8."
        )
    return ""
