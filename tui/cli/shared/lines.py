"""What is a LINE among the words of the command line."""

from __future__ import annotations

import os
import re

_KINDS = re.compile(r"(?:serial|tcp|rtu-tcp|sim):.*|COM\d+(?:,.*)?", re.IGNORECASE | re.DOTALL)


def is_line(text: str) -> bool:
    """Whether a word is meant for a LINE, rightly written or not: a kind, a path, a port."""
    path = text.partition(",")[0]
    return bool(_KINDS.fullmatch(text)) or "/" in text or "\\" in text or os.path.exists(path)
