"""Creation of a bundle: all its parts in their order, then the zip."""

from __future__ import annotations

from tui.bus.program import Program

from .archive import Bundle, archive
from .drive_parts import drive_parts, past_parts
from .line_parts import line_parts, record_parts
from .parts import PartProgress, collect_parts, in_own_thread
from .redaction import Redaction, local_names
from .subject import BundleSubject


async def make_bundle(
    subject: BundleSubject, stem: str, progress: PartProgress | None = None
) -> Bundle:
    """Collect the parts of a bundle and pack them; `stem` is its folder in the zip.

    No part ends it: what cannot be collected is in `Bundle.missing`. Raises nothing but a
    cancellation.
    """
    drives = [part for device in subject.devices for part in drive_parts(subject, device)]
    # after the drives, so that frames and counts contain what those parts have requested
    parts = [*drives, *line_parts(subject), *past_parts(subject), *record_parts(subject)]
    results = await collect_parts(parts, progress)
    results = [*results[len(drives) :], *results[: len(drives)]]

    def pack() -> Bundle:
        redaction = Redaction(local_names(program.user for program in _programs(subject)))
        redaction.learn(subject.text)
        return archive(results, redaction, stem)

    return await in_own_thread(pack)


def _programs(subject: BundleSubject) -> tuple[Program, ...]:
    """Return the programs on the line; messages name their users."""
    if subject.opened is None:
        return ()
    facts = subject.opened.line.facts
    return (*facts.programs, *facts.departed)
