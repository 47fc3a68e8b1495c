"""The key that listens to a line: which one, whether the panel may fall silent there, and going."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from textual.worker import get_current_worker

from tui.bus.errors import LineError
from tui.bus.link import SerialLink
from tui.drive.errors import DriveError

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.fleet import Fleet

    from .app_port import Panel

LISTENS_ALREADY = "The panel listens already; Esc ends that."
NO_LINE = "No line is chosen. Choose one on Line, then press H to monitor it."
CLOSES = (
    "The panel stops polling these drives: the port is opened for reading only, and nothing is sent"
    " until you end it, no stop either. Another master has to be there that asks and stops them."
)
CLOSE_FIRST = "To stop polling it anyway, close the line first: Ctrl+P, close."


def why_not_hear(fleet: Fleet) -> str:
    """Why the panel may not fall silent on a line, in a sentence; empty where it may."""
    from tui.session.monitor.timeout import names_of, polling_stop_text

    line, watch = fleet.line, fleet.line_watch
    if not isinstance(line.link, SerialLink):
        return "Over a network other masters cannot be monitored; this list shows all its traffic."
    if others := line.facts.others:
        who = ", ".join(other.text for other in others)
        return f"Not listened to: {who} uses the line too, and a port like that has no other user."
    if running := watch.under_command():
        who = "; ".join(names_of([session]) for session in running)
        return f"Not monitored: {who} runs by a command of this panel. Stop it first."
    if acting := watch.pending_timeouts():
        reported = next(session for session in fleet.sessions if session.device in acting)
        text = polling_stop_text(reported, watch=acting[reported.device])
        return f"Not listened to, as the panel feeds drives. {text} {CLOSE_FIRST}"
    if unread := watch.unread():
        who = names_of([unread[0]])
        return f"Not monitored yet: the reaction of {who} when polling stops was not read."
    unknown = [device for device, drive in fleet.found.items() if drive.console is None]
    if unknown:
        return (
            f"Not monitored: the reaction of device {unknown[0]} when polling stops is not known."
            f" {CLOSE_FIRST}"
        )
    return ""


def chosen_line(app: Panel) -> tuple[str, str]:
    """The line under the cursor of Line, else the one that is shown, with the typed profile."""
    choice = getattr(app.screen, "line_to_hear", None)
    return choice() if choice is not None else (app.line_text, "")


async def hear(app: Panel, text: str, profile: str) -> None:
    """Listen to a line; the app's keys are ignored until that has begun."""
    try:
        await _ask_to_hear(app, text, profile)
    finally:
        app.opening.end(get_current_worker())


async def _ask_to_hear(app: Panel, text: str, profile: str) -> None:
    if (here := app.open_line_of(text)) is not None:
        if why := why_not_hear(here.fleet):
            app.notify(why, severity="warning")
            return
        app.show_line(here)
        about = f"{here.opened.label} is closed for the panel. {CLOSES}" if here.fleet.found else ""
        if not await app.may_let_go("Listen to the line?", yes="Listen", no="Cancel", always=about):
            return
        if why := why_not_hear(here.fleet):  # it may have changed while that was asked
            app.notify(why, severity="warning")
            return
        app.show_line(here)
    app.hearing = text  # from here on no second key may begin it: the port would be taken twice
    try:
        if here is not None:
            await app.disconnect()
        await _listen(app, text, profile)
    except BaseException:
        app.hearing = ""
        raise


async def _listen(app: Panel, text: str, profile: str) -> None:
    from tui.session.listening.background import BackgroundListener

    from .frames.heard import ListeningScreen

    app.action_goto("line")
    try:
        named = await asyncio.to_thread(_named, profile)
        heard = BackgroundListener(text, "panel", named)
        opening = asyncio.ensure_future(asyncio.to_thread(heard.open))
        try:
            await asyncio.shield(opening)
        except asyncio.CancelledError:
            await asyncio.wait([opening])  # until then nothing else can have the port
            await asyncio.to_thread(heard.close)
            raise
    except (LineError, DriveError) as error:
        app.hearing = ""
        app.say_first(str(error), "Enter opens the line; H tries to listen again.", "error")
        return
    app.push_screen(ListeningScreen(heard))


def _named(profile: str) -> dict[int | None, Profile] | None:
    """The profile that was typed, for all drives; reads files."""
    from tui.drive.profile import library

    return {None: library.load(profile)} if profile else None
