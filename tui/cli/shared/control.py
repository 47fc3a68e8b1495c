"""The commands and keys that take a drive's control and give it back, for every text here."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.drive.control_source import ControlTaking
    from tui.session.drive import DriveSession

    from ..documents.parts import ControlField

TAKE_OPTION = "run --take-control"
GIVE_BACK_OPTION = "stop --give-back --arm"
TAKES = f"drivepanel {TAKE_OPTION} takes it, in the panel t on Monitor."
GIVES_BACK = f"drivepanel {GIVE_BACK_OPTION} gives it back, in the panel g on Monitor."


def taking_of(session: DriveSession) -> ControlTaking | None:
    """Return the possible changes of a drive's control, from the values read."""
    from tui.drive.control_source import control_taking

    return control_taking(session.profile, session.image.raws)


def control_field(session: DriveSession) -> ControlField | None:
    """Holder of the control, and the commands that change it; None if a drive has no control."""
    from ..documents.parts import ControlField

    found = taking_of(session)
    if found is None:
        return None
    return ControlField(
        taken=found.taken,
        take=TAKE_OPTION if found.can_take else None,
        give_back=GIVE_BACK_OPTION if found.can_give_back else None,
    )


def control_row(session: DriveSession) -> list[tuple[str, str]]:
    """The same for a person; nothing where a drive has none of it."""
    found = taking_of(session)
    if found is None:
        return []
    if found.can_take and found.taken is False:
        return [("Control", f"not taken by the line: {TAKES}")]
    if not found.can_give_back or found.is_given_back:
        return []
    return [("Control", f"taken by the line: {GIVES_BACK}" if found.taken else GIVES_BACK)]


def way_to_take(session: DriveSession) -> str:
    """Return how to take control, for a refused command; empty if that does not help."""
    found = taking_of(session)
    if found is None or not found.can_take or found.taken is not False:
        return ""
    return f"{TAKE_OPTION} takes the control first."
