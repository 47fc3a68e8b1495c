"""The text of a new profile that begins as a copy of another."""

from __future__ import annotations

import re

from ..errors import ProfileError

_HEAD = re.compile(r"^\[profile\][^\n]*\n.*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)
_ID = re.compile(r"""^id[ \t]*=[ \t]*(?:"[^"\n]*"|'[^'\n]*')""", re.MULTILINE)
_PREFIXES = re.compile(r"^reference_prefixes[ \t]*=[ \t]*\[[^\]]*\]", re.MULTILINE)
_DEMO = re.compile(r"^demo_hz[^\n]*\n", re.MULTILINE)
IDENTIFIER = re.compile(r"[a-z][a-z0-9_-]*")


def new_profile_text(source: str, old_id: str, new_id: str) -> str:
    """A profile's text under another id; no drive is recognised as it before somebody says so.

    Raises ProfileError for an id that cannot be one, and for a file without a plain head.
    """
    if not IDENTIFIER.fullmatch(new_id):
        raise ProfileError(
            f"{new_id!r} cannot be an id: small letters, digits, - and _, a letter first."
        )
    head = _HEAD.search(source)
    if head is None or not _ID.search(head[0]):
        raise ProfileError(f"The profile {old_id} has no plain table [profile] to copy.")
    changed = _DEMO.sub("", _ID.sub(f'id = "{new_id}"', head[0], count=1))
    text = source[: head.start()] + changed + source[head.end() :]
    return _PREFIXES.sub(
        '# beginnings of the reference that the drive tells, such as ["NEW12"]\n'
        "reference_prefixes = []",
        text,
        count=1,
    )
