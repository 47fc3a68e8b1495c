"""Line problems in the last minute: too few good replies, foreign frames, stray replies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from tui.bus.api import LastMinute, LineCounters
from tui.drive.sentences import counted

LEAST_REPLIES = 20
"""Least replies in the last minute for a judgment."""
POOR, HEALTHY = 0.98, 0.99
"""Share of good replies below which a trouble begins, and from which it ends."""
SEVERAL_FRAMES = 3
"""Foreign frames or strays in a minute that make a trouble; it ends after a minute with none."""
HEALTHY_AGAIN = "The line is healthy again: {} % of the replies were good in the last minute."

TroubleKind = Literal["poor", "foreign", "strays"]


class LineTrouble(NamedTuple):
    """One trouble of a line."""

    kind: TroubleKind
    signs: tuple[str, ...]
    """Short texts for the status bar, longest first."""
    text: str
    """The event, its meaning, and the first step."""


class LineHealth:
    """Judges a line by its last minute, repeatedly. For one thread only."""

    def __init__(self) -> None:
        self.troubles: tuple[LineTrouble, ...] = ()
        """Troubles found by the last call of `look`."""
        self._poor: frozenset[int | None] = frozenset()
        """Drives with too few good replies; None stands for the whole line."""

    def look(self, counted: LineCounters) -> list[tuple[str, str]]:
        """Judge these counts; return the new messages as pairs of event kind and text."""
        line, drives = (
            counted.minute,
            {d: counters.minute for d, counters in counted.devices.items()},
        )
        before = {trouble.kind for trouble in self.troubles}
        judged: list[tuple[int | None, LastMinute]] = [(None, line), *drives.items()]
        poor = (of for of, minute in judged if _is_poor(minute, of in self._poor))
        self._poor = frozenset(poor)
        self.troubles = tuple(self._found(line, drives, before))
        if before and not self.troubles and line.share is not None:
            return [("done", HEALTHY_AGAIN.format(percent(line.share).strip()))]
        return [("alarm", trouble.text) for trouble in self.troubles if trouble.kind not in before]

    def forget(self) -> None:
        """Discard all troubles, because the line is lost."""
        self.troubles, self._poor = (), frozenset()

    def _found(
        self, line: LastMinute, drives: dict[int, LastMinute], before: set[TroubleKind]
    ) -> Iterator[LineTrouble]:
        if self._poor:
            yield _few_good(line, drives, self._poor)
        if line.foreign >= (1 if "foreign" in before else SEVERAL_FRAMES):
            yield LineTrouble("foreign", ("foreign frames", "foreign", ""), _foreign(line.foreign))
        if line.strays >= (1 if "strays" in before else SEVERAL_FRAMES):
            yield LineTrouble("strays", ("stray replies", "strays", ""), _strays(line.strays))


def percent(share: float | None) -> str:
    """Format a share as whole percent in three characters, rounded down."""
    return " --" if share is None else f"{int(100 * share):>3}"


def _is_poor(minute: LastMinute, was_poor: bool) -> bool:
    share = minute.share
    if share is None:
        return False
    if minute.replies < LEAST_REPLIES:
        return was_poor and share < HEALTHY
    return share < (HEALTHY if was_poor else POOR)


def _few_good(
    line: LastMinute, drives: dict[int, LastMinute], poor: frozenset[int | None]
) -> LineTrouble:
    """Describe too few good replies, of the line or of its worst drive."""
    shares = {device: minute.share for device, minute in drives.items() if minute.share is not None}
    if None in poor:
        # by the number of bad replies: in a small total, one lost reply is a large share
        worst = max(shares, key=lambda item: drives[item].replies - drives[item].good, default=0)
    else:
        worst = min((number for number in poor if number), key=lambda item: shares[item])
    choose = f"Choose drive {worst} on Line and press N for the cause."
    if None not in poor:
        share = percent(shares[worst]).strip()
        text = f"{_lost(drives[worst], worst)} {choose}"
        return LineTrouble("poor", (f"drive {worst} {share:>2} % good", f"drive {worst}", ""), text)
    share = percent(line.share).strip()
    if len(shares) > 1:
        choose = f"Worst: drive {worst}, {percent(shares[worst]).strip()} %. {choose}"
    signs = (f"line {share:>2} % good", f"line {share:>2} %", f"{share:>2} %", "")
    return LineTrouble("poor", signs, f"{_lost(line)} {choose}")


def _lost(minute: LastMinute, drive: int | None = None) -> str:
    text = _FEW_GOOD if drive is None else _FEW_GOOD_OF_DRIVE
    return text.format(share=percent(minute.share).strip(), minute=minute, drive=drive)


_FEW_GOOD = (
    "Only {share} % of {minute.replies} replies were good in the last minute: {minute.lost} lost,"
    " {minute.damaged} damaged."
)
_FEW_GOOD_OF_DRIVE = (
    "Only {share} % of {minute.replies} replies of drive {drive} were good in the last minute:"
    " {minute.lost} lost, {minute.damaged} damaged."
)


def _foreign(count: int) -> str:
    frames = counted(
        count, "1 foreign frame in the last minute.", "{count} foreign frames in the last minute."
    )
    return (
        f"{frames} Another master is on this line, or an adapter echoes."
        " Press N to find out before you command a motor."
    )


def _strays(count: int) -> str:
    replies = counted(
        count, "1 stray reply in the last minute.", "{count} stray replies in the last minute."
    )
    return (
        f"{replies} Two drives have one address, or an adapter repeats frames."
        " Press N to find out before you command a motor."
    )
