"""The care for a drive: with it, the holder of a line can stop the drive without its program.

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
    """The care for one drive, as it goes to the holder of its line."""

    profile: Annotated[bytes, Meta(max_length=MOST_CARE)]
    """As Profile.packed."""
    identity: DriveIdentity | None
    guessed: bool


def packed_care(profile: Profile, identity: DriveIdentity | None, *, guessed: bool) -> bytes:
    """The bytes of the care for a drive."""
    return msgspec.msgpack.encode(CareData(profile.packed, identity, guessed))
