"""Fate of a motor that this program leaves on a shared line, in a sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tui.safety import LONGEST_GRACE

if TYPE_CHECKING:
    from ..drive import DriveSession

OTHERS_ASK = "Other programs on the line ask"


def peer_effect_text(session: DriveSession, *, on_purpose: bool) -> str:
    """Return the reaction of other programs to a motor that is left; empty if none.

    `on_purpose`: it is put on record as left running. Otherwise the owner of the line stops a motor
    that was started here, by its OrphanMotorGuard.
    """
    others, starts = session.line.facts.others, session.starts
    if not others:
        return ""
    text = others[0].text if len(others) == 1 else ""
    if not on_purpose and starts is not None and starts.stopped_by_others(session.device):
        who = f"{text[0].upper()}{text[1:]} is" if text else "Other programs are"
        taken = "it is taken over there, or " if any(o.name == "panel" for o in others) else ""
        return (
            f"{who} on the line, too: the motor is stopped on its ramp within {LONGEST_GRACE:g} s,"
            f" unless {taken}the line is opened here again."
        )
    if session.device not in session.line.pace.others:
        return ""
    who, do = (f"{text[0].upper()}{text[1:]} asks", "it does") if text else (OTHERS_ASK, "they do")
    return f"{who} it on: while {do}, the motor runs on."
