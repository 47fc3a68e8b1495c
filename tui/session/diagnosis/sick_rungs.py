"""Form of a check of a diagnosis; checks that need many reads, and those of a gateway."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from tui.bus.errors import ONE_BEHIND
from tui.drive.sentences import sentence

from . import next_steps as steps
from .evidence import DiagnosticEvidence
from .gateway_probe import Works
from .measure import Measure
from .sick import (
    CERTAIN,
    LIKELY,
    POSSIBLE,
    SICK_FRAMES,
    says_sick,
    says_swapped,
    says_two_drives,
    sureness,
    swapped,
)

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


def _measure(sight: DiagnosticEvidence) -> Measure:
    assert sight.measure is not None
    return sight.measure


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


GATEWAY_RUNGS = (
    Check(
        "other-master",
        lambda s: bool(s.overheard),
        lambda s: first_sentence(s.overheard),
        steps.one_master,
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
