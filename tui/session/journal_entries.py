"""Journal entries of written parameters, whatever wrote them."""

from __future__ import annotations

from tui.drive.profile.schema import Parameter
from tui.drive.shown import shown_text

from .drive import DriveSession
from .journal import Entry, now_text

CUT_SHORT = "a stop came: not known whether it was taken"
"""Entry of a write that was ended before its answer."""


def raw_text(session: DriveSession, parameter: Parameter, raw: int | None) -> str:
    """A raw value as a person reads it; nothing for None."""
    image = session.image
    return shown_text(session.profile, parameter, raw, image.raws, image.lacking)


def parameter_entry(
    session: DriveSession,
    parameter: Parameter,
    *,
    old: int | None,
    new: int,
    answer: str,
    why: str,
    read_back: int | None = None,
) -> Entry:
    """A write in progress: raw values before and after, the answer, and the value read back."""
    return Entry(
        time=now_text(),
        line=session.line_text,
        device=session.device,
        profile=session.profile.id,
        code=parameter.code,
        address=parameter.address,
        old_raw=old,
        old=raw_text(session, parameter, old),
        new_raw=new,
        new=raw_text(session, parameter, new),
        answer=answer,
        read_back=read_back,
        why=why,
    )
