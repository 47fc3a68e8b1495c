"""The block of a profile, for tests."""

from __future__ import annotations

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block


def block_of(profile: Profile, direction: str) -> Block:
    """Return the block that is read (`read`) or written (`write`)."""
    return next(block for block in profile.data.blocks if block.direction == direction)
