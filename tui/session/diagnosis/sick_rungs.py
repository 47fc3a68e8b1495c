"""Form of a check of a diagnosis; checks that need many reads, and those of a gateway.

Verdicts follow from the shares of faulty frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from tui.bus.errors import ONE_BEHIND
from tui.bus.link import TcpLink
from tui.drive.sentences import sentence

from . import next_steps as steps
from .evidence import DiagnosticEvidence
from .gateway_probe import Works
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
    tcp_text: str = ""
    """Text over Modbus TCP if it differs."""

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
        "replies came damaged: their length does not fit",
    ),
    SickFrames(
        "duplicated", "duplicated", "replies came twice",
        ("Two drives with the same values have this address.",),
    ),
    SickFrames(
        "surplus", "two-drives", "requests got a second reply with other values",
        ("Something on the way doubles the replies.",),
    ),
    SickFrames(
        "foreign", "other-address", "replies carried another address",
        ("Another master asks other drives.",),
    ),
    SickFrames(
        "unreached", "gateway", "requests got exception 0A or 0B: the gateway missed the drive",
        ("The drive does not hear each request.", "Two drives have this address."),
    ),
    SickFrames(
        "stray", "stray-bytes", "replies came intact, but with stray bytes before or after them",
        ("Another device sends on this line.", "The adapter adds bytes as it changes direction."),
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
    fault = kind.tcp_text if kind.tcp_text and isinstance(sight.link, TcpLink) else kind.text
    text = f"In {measure.seconds:.1f} s, {count} of {measure.requested} {fault}"
    return f"{text}; also {', '.join(beside)}." if beside else f"{text}."


def says_two_drives(sight: DiagnosticEvidence) -> str:
    """Return the verdict of two drives at one address."""
    measure = _measure(sight)
    return (
        f"Two drives have address {sight.device}: {measure.requested} requests got"
        f" {measure.second} second replies with other values and"
        f" {measure.damaged + measure.stray} damaged ones."
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


Steps = Callable[[DiagnosticEvidence], Iterable[str]]


@dataclass(frozen=True, slots=True)
class Check:
    """Check for one possible cause."""

    id: str
    fails: Callable[[DiagnosticEvidence], bool]
    says: Callable[[DiagnosticEvidence], str]
    """Cause as one sentence."""
    steps: Steps
    certainty: Callable[[DiagnosticEvidence], str] = lambda _: CERTAIN
    others: tuple[str, ...] = ()
    """Other possible causes, if the verdict is not certain."""


def first_sentence(text: str) -> str:
    """The first sentence of a text."""
    return sentence(text.partition(". ")[0])


def _works(sight: DiagnosticEvidence) -> Works:
    assert sight.works is not None
    return sight.works


def _is_behind(sight: DiagnosticEvidence) -> bool:
    """True if the line or the reads show it; a line that is one behind has no surplus replies."""
    count = sight.measure
    if count is None:
        return sight.behind
    return count.one_behind or (sight.behind and not count.two_drives)


def _says_behind(sight: DiagnosticEvidence) -> str:
    count = sight.measure
    if sight.behind or count is None:
        return f"{ONE_BEHIND}: each request gets the reply to the one before."
    return (
        f"{ONE_BEHIND}: {count.behind} of {count.requested} requests got the reply to the request"
        " before."
    )


def _sureness_of_behind(sight: DiagnosticEvidence) -> str:
    count = sight.measure
    if sight.behind or count is None:
        return LIKELY
    return POSSIBLE if count.late else sureness(count.behind)


NOISE_CAUSE = "An idle line picks up noise: its polarization is missing."
GATEWAY_RUNGS = (
    Check(
        "other-master",
        lambda s: bool(s.overheard),
        lambda s: first_sentence(s.overheard),
        lambda s: steps.find_sender(s) if s.loose else steps.one_master(s),
        lambda s: LIKELY if s.loose else CERTAIN,
        (NOISE_CAUSE,),
    ),
    Check(
        "wrong-protocol",
        lambda s: s.works is not None and s.works.unit is None,
        lambda s: f"The gateway does not speak the protocol of this line: {_works(s).line} works.",
        steps.open_what_works,
    ),
    Check(
        "other-unit",
        lambda s: s.works is not None and s.works.unit is not None,
        lambda s: f"The gateway answers unit {_works(s).unit}, and not address {s.device}.",
        steps.set_unit,
    ),
    Check(
        "behind",
        _is_behind,
        _says_behind,
        steps.restart_converter,
        _sureness_of_behind,
        ("Another master asks the same drive.", "The replies come much later."),
    ),
)
"""Checks that need no reply on the line itself."""
SICK_RUNGS: tuple[Check, ...] = (
    Check(
        "two-drives",
        lambda s: s.measure is not None and s.measure.two_drives,
        says_two_drives,
        steps.part_drives,
        lambda s: sureness(_measure(s).turns + _measure(s).second),
        ("Another master writes to the drive, and its frames collide.",),
    ),
    Check(
        "swapped",
        swapped,
        says_swapped,
        steps.swap_bytes,
        lambda s: sureness(_measure(s).swapped),
        ("The drive is of another family than its profile.",),
    ),
    *(
        Check(
            kind.rung,
            kind.fails,
            partial(says_sick, kind),
            steps.SICK_STEPS[kind.rung],
            kind.certainty,
            kind.others,
        )
        for kind in SICK_FRAMES
    ),
    Check(
        "idle-close",
        lambda s: s.idle_closed,
        lambda s: f"The gateway closes a connection on which nothing is sent for {s.idle:.0f} s.",
        steps.keep_connection,
        lambda _: LIKELY,
        ("Its network was cut at that moment.", "It serves one client, and another one came."),
    ),
)
"""The first that applies is the verdict."""
