"""Example frames: requests with their replies, from `frames.json` and from the profile itself."""

from __future__ import annotations

import msgspec

from ..small_file import read_small
from .library import packaged_folder
from .profile import Profile


class ExampleFrame(msgspec.Struct, frozen=True):
    """One frame of a manual, with its checksum."""

    family: str
    section: str
    direction: str
    hex: str
    meaning: str
    printed: str = ""
    """The printed form, if it has a misprint."""

    @property
    def data(self) -> bytes:
        """The frame as it is sent."""
        return bytes.fromhex(self.hex)


class FramePair(msgspec.Struct, frozen=True):
    """A request, and the replies that the manual prints for it, one for each situation."""

    request: ExampleFrame
    replies: tuple[ExampleFrame, ...]


def all_frames() -> list[ExampleFrame]:
    """Return all frames, in the order of their manuals."""
    path = packaged_folder() / "frames.json"
    return msgspec.json.decode(read_small(path), type=list[ExampleFrame])


def example_frames_of(profile: Profile) -> list[FramePair]:
    """Return the requests of the family's manual and of the profile with their replies."""
    head = profile.data.profile
    families = {head.id, *(name.removesuffix(".rows") for name in head.rows_from)}
    pairs: list[FramePair] = []
    for frame in all_frames():
        if frame.family not in families:
            continue
        if frame.direction == "request":
            pairs.append(FramePair(frame, ()))
        else:
            last = pairs[-1]
            pairs[-1] = FramePair(last.request, (*last.replies, frame))
    for own in profile.data.frames:
        sent, reply = (
            ExampleFrame(head.id, own.source, direction, data, ", ".join(own.means))
            for direction, data in (("request", own.sent), ("response", own.answered))
        )
        pairs.append(FramePair(sent, (reply,)))
    return pairs
