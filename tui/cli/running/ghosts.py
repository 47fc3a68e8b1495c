"""Ghosts of recorded drives for `drivepanel simulate --from`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ..documents.other_documents import GhostDocument, GhostField
from ..shared.output import iso_time, json_text
from ..shared.say import say_beside
from ..shared.standard_streams import NO_RECORD_FROM_INPUT, STANDARD

if TYPE_CHECKING:
    from tui.session.record.ghost import GhostRecord


def ghosts_of(texts: Sequence[str]) -> list[GhostRecord]:
    """Read the drives of `FILE@ADDRESS`. Raises UsageError."""
    if not texts:
        return []
    from tui.session.record.ghost import GhostError, read_recorded

    try:
        if any(text.startswith(f"{STANDARD}@") for text in texts):
            raise click.UsageError(NO_RECORD_FROM_INPUT)
        return [read_recorded(text) for text in texts]
    except GhostError as error:
        raise click.UsageError(str(error)) from None


def ghost_field(recorded: GhostRecord, once: bool) -> GhostField:
    """Return a ghost as a part of the first document of `simulate`."""
    last = recorded.exchanges[-1]
    return GhostField(
        device=recorded.device,
        profile=recorded.profile.id if recorded.profile else None,
        file=str(recorded.path),
        begun=iso_time(recorded.begun),
        seconds=round(last.at + last.took, 3),
        repeats=not once,
    )


def say_ghost(text: str, as_json: bool) -> None:
    """Print a sentence of a ghost: its end, or a request that its record does not have."""
    if as_json:
        say_beside(json_text(GhostDocument(text=text)), as_it_is=True)
    else:
        say_beside(text)
