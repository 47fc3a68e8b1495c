"""Verdicts from the shares of faulty frames: the text of each, and its certainty; pure."""

from __future__ import annotations

from dataclasses import dataclass

from .evidence import DiagnosticEvidence
from .measure import Measure

CERTAIN, LIKELY, POSSIBLE = "certain", "likely", "possible"
SURE_FROM, LIKELY_FROM = 5, 2
"""Number of faulty frames from which a verdict is certain, and likely."""
SWAPPED_FROM = 3
"""Number of values that must be plausible only with swapped bytes."""


def sureness(count: int) -> str:
    """Return the certainty of a verdict by its number of faulty frames."""
    return CERTAIN if count >= SURE_FROM else LIKELY if count >= LIKELY_FROM else POSSIBLE


@dataclass(frozen=True, slots=True)
class SickFrames:
    """Verdict for one kind of faulty frame."""

    kind: str
    rung: str
    text: str
    others: tuple[str, ...]

    def fails(self, sight: DiagnosticEvidence) -> bool:
        """True if most faulty frames are of this kind."""
        return sight.measure is not None and sight.measure.worst == self.kind

    def certainty(self, sight: DiagnosticEvidence) -> str:
        """Certainty of the verdict."""
        assert sight.measure is not None
        return sureness(sight.measure.count(self.kind))


SICK_FRAMES = (
    SickFrames(
        "late", "late", "replies did not come in time",
        ("Something on the way doubles the replies.",),
    ),
    SickFrames(
        "lost", "lost", "requests got no reply",
        ("The replies come much later.", "Another master disturbs the requests."),
    ),
    SickFrames(
        "damaged", "checksum", "replies came damaged: the checksum does not fit",
        ("Two drives have this address.", "Another master is on the line."),
    ),
    SickFrames(
        "duplicated", "duplicated", "replies came twice",
        ("Two drives with the same values have this address.",),
    ),
    SickFrames(
        "foreign", "other-address", "replies carried another address",
        ("Another master asks other drives.",),
    ),
    SickFrames(
        "unreached", "gateway", "requests got exception 0A or 0B: the gateway missed the drive",
        ("The drive does not hear each request.", "Two drives have this address."),
    ),
)  # fmt: skip


def says_sick(kind: SickFrames, sight: DiagnosticEvidence) -> str:
    """Return the verdict with its share, and other faults."""
    measure = _measure(sight)
    count = measure.count(kind.kind)
    beside = [
        f"{measure.count(frame.kind)} {frame.kind}"
        for frame in SICK_FRAMES
        if frame is not kind and measure.count(frame.kind)
    ]
    text = f"In {measure.seconds:.1f} s, {count} of {measure.requested} {kind.text}"
    return f"{text}; also {', '.join(beside)}." if beside else f"{text}."


def says_two_drives(sight: DiagnosticEvidence) -> str:
    """Return the verdict of two drives at one address."""
    measure = _measure(sight)
    return (
        f"Two drives have address {sight.device}: {measure.requested} requests got"
        f" {measure.second} second replies with other values and {measure.damaged} damaged ones."
    )


def swapped(sight: DiagnosticEvidence) -> bool:
    """True if values are plausible only with swapped bytes."""
    measure = sight.measure
    return measure is not None and measure.swapped >= SWAPPED_FROM and not measure.straight


def says_swapped(sight: DiagnosticEvidence) -> str:
    """Return the verdict of swapped bytes."""
    return (
        f"The bytes of each word are swapped: {_measure(sight).swapped} settings make sense only"
        " with their bytes changed over."
    )


def _measure(sight: DiagnosticEvidence) -> Measure:
    assert sight.measure is not None
    return sight.measure
