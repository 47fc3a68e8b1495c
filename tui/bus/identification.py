"""Identity of a device by functions 43/14 and 17: objects from checked replies."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

REFERENCE = 1
"""The object of function 43/14 that says which drive it is."""
_WORDS = re.compile(rb"[ -~]{3,}")


def own_words_of(pdu: bytes) -> bytes:
    """The longest text in a checked reply of function 17; the bytes around it are its maker's."""
    return max(_WORDS.findall(pdu[2:]), key=len, default=b"").strip()


@dataclass(frozen=True, slots=True)
class Objects:
    """Objects of one or several replies of function 43/14."""

    conformity: int = 0
    objects: Mapping[int, bytes] = field(default_factory=dict)
    next_object: int | None = 0
    """The object that the next request asks for; None when nothing follows."""
    trouble: str = ""
    """Why they cannot be taken for an identification, empty if they can."""

    def with_more(self, pdu: bytes) -> Objects:
        """These objects, and those of a checked reply that follows."""
        objects = dict(self.objects)
        trouble, at = "", 7
        for _ in range(pdu[6]):
            length = pdu[at + 1]
            number, content = pdu[at], bytes(pdu[at + 2 : at + 2 + length])
            if objects.setdefault(number, content) != content:
                both = f"{_quoted(objects[number])} and {_quoted(content)}"
                trouble = f"object {number} came with two contents, {both}"
            at += 2 + length
        follows = pdu[5] if pdu[4] else None
        if follows is not None and follows <= (self.next_object or 0):
            trouble = trouble or "its identification does not end"
        return Objects(pdu[3], objects, follows, trouble)


def _quoted(content: bytes) -> str:
    return repr(content.decode("ascii", errors="replace"))
