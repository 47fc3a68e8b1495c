"""How a drive is stopped by the process that holds its line, as its own program tells it there.

The profile goes as data: the holder may have another folder of profiles, or the file may have
changed since.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from tui.bus.bounds import MOST_CARE
from tui.drive.profile.profile import Profile

from .connect.identify import DriveIdentity


class CareData(msgspec.Struct, frozen=True):
    """What it takes to stop one drive."""

    profile: Annotated[bytes, Meta(max_length=MOST_CARE)]
    """As Profile.packed."""
    identity: DriveIdentity | None
    guessed: bool


def packed_care(profile: Profile, identity: DriveIdentity | None, *, guessed: bool) -> bytes:
    """What the holder of a line is told of a drive."""
    return msgspec.msgpack.encode(CareData(profile.packed, identity, guessed))
