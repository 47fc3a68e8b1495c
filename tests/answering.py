"""Automatic reply of a terminal to a request for its cursor position."""

from __future__ import annotations

import os
from contextlib import suppress

ASK, ANSWER = b"\x1b[6n", b"\x1b[1;1R"


def read_answering(terminal: int, size: int = 65536) -> bytes:
    """Read a program's output on a terminal, and answer its requests; raises OSError.

    A request that two reads split is completed and answered at once.
    """
    data = os.read(terminal, size)
    for cut in range(1, len(ASK)):
        if data.endswith(ASK[:cut]):
            with suppress(OSError):
                data += os.read(terminal, len(ASK) - cut)
            break
    with suppress(OSError):
        os.write(terminal, ANSWER * data.count(ASK))
    return data
