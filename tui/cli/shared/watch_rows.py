"""Communication watch of a drive in `status`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.session.timeout_report import TimeoutWatch

    from ..documents.parts import OldTimeoutField


def watch_field(watch: TimeoutWatch | None) -> OldTimeoutField | None:
    """A drive's watch over the line; null where it has none."""
    from ..documents.parts import OldTimeoutField

    if watch is None:
        return None
    return OldTimeoutField(
        timeout_s=watch.timeout,
        reaction=watch.reaction.name if watch.reaction else None,
        does=watch.reaction.does if watch.reaction else None,
        begun=watch.active,
    )


def watch_text(watch: TimeoutWatch | None) -> str:
    """Return a drive's reaction to loss of communication, for a person."""
    if watch is None:
        return "none: it goes on without communication"
    if watch.reaction is not None and not watch.acts:
        return f"off ({watch.reaction.name}): it goes on without communication"
    reaction = watch.reaction.does if watch.reaction else "its own reaction follows"
    begins = "" if watch.active else " It begins with the first command or reference."
    return f"{watch.timeout:g} s, then: {reaction.rstrip('.')}.{begins}"
