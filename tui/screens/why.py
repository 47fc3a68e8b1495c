"""The key that shows why a drive does not answer: choosing the drive, and the diagnosis."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from tui.bus.errors import LinkSyntaxError
from tui.bus.link import parse_link

from .dialogs.why_target import WhyTarget

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.console import DriveConsole
    from tui.session.diagnosis.diagnosis import Diagnosis

    from .app_port import Panel


def ask_why(app: Panel) -> None:
    """Look at the drive that is meant on Line, else at the open one, and show what fails."""
    intended = getattr(app.screen, "why_target_now", None)
    target: WhyTarget | None = intended() if intended is not None else _open_drive(app)
    if target is None:
        app.tell("No drive is chosen. Choose a line, or a drive, on Line.")
        return
    if target.opened is None:
        try:
            parse_link(target.text)
        except LinkSyntaxError:
            app.tell("This line is not open. Press Enter to open it, then N to diagnose.")
            return
    from .dialogs.why import WhyScreen

    label = target.opened.label if target.opened is not None else target.text
    about = f"Why no answer? Address {target.device} on {label}"
    app.push_screen(WhyScreen(about, partial(_kept, app, target)))


def _open_drive(app: Panel) -> WhyTarget | None:
    """The drive that a screen is about, else the one that is open."""
    console: DriveConsole | None = getattr(app.screen, "console", None) or app.chosen
    if console is None or app.opened is None:
        return None
    session, found = console.session, app.fleet.found if app.fleet is not None else {}
    return WhyTarget(
        app.opened.text,
        session.device,
        app.opened,
        session.profile.id,
        tuple(number for number in found if number != session.device),
    )


async def _kept(app: Panel, target: WhyTarget) -> Diagnosis:
    """The diagnosis, which the drive keeps for its Wiring page."""
    found = await _looked(target)
    fleet = app.fleet
    console = fleet.console(target.device) if fleet is not None else None
    if target.opened is not None and target.opened is app.opened and console is not None:
        console.diagnosis, console.diagnosed_at = found, app.clock.wall()
    return found


async def _looked(target: WhyTarget) -> Diagnosis:
    """Return the evidence, and the check that fails."""
    from tui.session.diagnosis.asking import evidence_of_port, profile_remembered
    from tui.session.diagnosis.diagnosis import diagnosed
    from tui.session.diagnosis.examining import examine_line

    opened = target.opened
    link = opened.line.link if opened is not None else parse_link(target.text)
    profile = await asyncio.to_thread(_profile, target)
    profile = profile or await asyncio.to_thread(profile_remembered, link, target.device)
    if opened is None:
        seen = await asyncio.to_thread(evidence_of_port, link, target.device, target.trouble)
        return diagnosed(replace(seen, profile=profile))
    line = opened.line
    answer = [neighbor for neighbor in target.neighbors if line.device_state(neighbor).answers]
    changed = opened.known.text if opened.known is not None else ""
    return diagnosed(
        await examine_line(line, target.device, profile, changed=changed, answering=answer)
    )


def _profile(target: WhyTarget) -> Profile | None:
    from tui.drive.errors import DriveError
    from tui.drive.profile import library

    try:
        return library.load(target.profile) if target.profile else None
    except DriveError:
        return None  # told where it was typed
