"""Detection of LINEs among the words of the command line."""

from __future__ import annotations

import os
import re

_NAME = re.compile(r"[A-Za-z][\w-]*")
_KINDS = re.compile(r"(?:serial|tcp|rtu-tcp|sim):.*|COM\d+(?:,.*)?", re.IGNORECASE | re.DOTALL)


def is_line(text: str) -> bool:
    """Return True if a word is meant for a LINE, rightly written or not: a kind, a path, a port."""
    path = text.partition(",")[0]
    if is_written_out(text) or os.path.exists(path):
        return True
    return is_known_name(text, doubtful=True)


def is_written_out(text: str) -> bool:
    """Return True if a word is a LINE by its signs alone, as no code of a parameter is."""
    return bool(_KINDS.fullmatch(text)) or "/" in text or "\\" in text


def is_known_name(text: str, *, doubtful: bool = False) -> bool:
    """Return True if the settings file names a line so; `doubtful`: or may do, as it has faults."""
    if not _NAME.fullmatch(text):
        return False  # the file need not be looked at
    from tui.session.connect.named_lines import is_name, line_settings

    settings = line_settings()
    return text.casefold() in settings.lines or bool(doubtful and settings.faults and is_name(text))
