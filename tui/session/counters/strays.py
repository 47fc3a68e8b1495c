"""Stray frames: frames that answer no program's request, and their likely origin."""

from __future__ import annotations

from collections.abc import Sequence

from tui.bus.trace import Frame

from ..connect.other_masters import overheard
from ..diagnosis.measure import measure_of
from .compare import Difference

LIKELY = "late or repeated replies, a second drive at the address, or another master"


def stray_difference(
    count: int, frames: Sequence[Frame], since: float, device: int, *, tcp: bool
) -> list[Difference]:
    """Return a difference for this number of strays, or an empty list for 0.

    The recorded frames after `since` (line's clock) show their kinds, if they are still recorded.
    """
    if count <= 0:
        return []
    frames = [frame for frame in frames if frame.time > since]
    found = measure_of(frames, device, tcp=tcp)
    kinds = (
        (found.duplicated, "copies of replies"),
        (found.late, "replies after their timeout"),
        (found.second, "second replies with other values"),
        (found.behind, "replies to the request before"),
        (found.foreign, "replies of other addresses"),
    )
    seen = ", ".join(f"{number} {text}" for number, text in kinds if number) or LIKELY
    master = "" if tcp or not (heard := overheard(frames, since)).requests else f" {heard.text}"
    whole = "1 frame answers" if count == 1 else f"{count} frames answer"
    text = f"{whole} no program's request: {seen}.{master} drivepanel why names the cause."
    return [Difference("strays", count, text)]
