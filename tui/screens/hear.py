"""The key that listens to a line: choosing it, checking that polling may stop, and starting."""

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

LISTENS_ALREADY = "The panel is already listening. Press Esc to end it."
NO_LINE = "No line is chosen. Choose one on Line, then press H to monitor it."
CLOSES = (
    "The panel stops polling these drives. It opens the port for reading only and sends nothing"
    " until you press Esc, not even a stop. Another master must poll and stop them."
)
CLOSE_FIRST = "To stop polling it anyway, close the line first: Ctrl+P, close."


def why_not_hear(fleet: Fleet) -> str:
    """Return why the panel may not stop polling a line to listen to it; empty if it may."""
    from tui.session.monitor.timeout import names_of, polling_stop_text

    line, watch = fleet.line, fleet.line_watch
    if not isinstance(line.link, SerialLink):
        return (
            "Other masters cannot be monitored over a network. Frames (7) shows all traffic of"
            " this connection."
        )
    if others := line.facts.others:
        who = ", ".join(other.text for other in others)
        return f"Not monitored: {who} also uses the line. Listening needs the port to itself."
    if running := watch.under_command():
        who = "; ".join(names_of([session]) for session in running)
        return f"Not monitored: this panel commands a running motor ({who}). Stop it first."
    if acting := watch.pending_timeouts():
        reported = next(session for session in fleet.sessions if session.device in acting)
        text = polling_stop_text(reported, watch=acting[reported.device])
        return f"Not monitored: the panel keeps drives alive. {text} {CLOSE_FIRST}"
    if unread := watch.unread():
        who = names_of([unread[0]])
        return f"Not monitored yet: the communication loss reaction of {who} has not been read."
    unknown = [device for device, drive in fleet.found.items() if drive.console is None]
    if unknown:
        return (
            f"Not monitored: the communication loss reaction of device {unknown[0]} is not known."
            f" {CLOSE_FIRST}"
        )
    return ""


def chosen_line(app: Panel) -> tuple[str, str]:
    """The line under the cursor of Line, else the one shown; with the profile typed on Line."""
    choice = getattr(app.screen, "line_to_hear", None)
    return choice() if choice is not None else (app.line_text, "")


async def hear(app: Panel, text: str, profile: str) -> None:
    """Listen to a line; keys are ignored until listening has begun."""
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
        about = CLOSES if here.fleet.found else ""
        if not await app.may_let_go("Listen to the line?", yes="Listen", no="Cancel", always=about):
            return
        if why := why_not_hear(here.fleet):  # it may have changed during the question
            app.notify(why, severity="warning")
            return
        app.show_line(here)
    app.hearing = text  # set now, so that a second key does not open the port twice
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
            await asyncio.wait([opening])  # the port can be released only then
            await asyncio.to_thread(heard.close)
            raise
    except (LineError, DriveError) as error:
        app.hearing = ""
        app.say_first(str(error), "Press Enter to open the line, H to try again.", "error")
        return
    app.push_screen(ListeningScreen(heard))


def _named(profile: str) -> dict[int | None, Profile] | None:
    """The profile that was typed, for all drives; reads files."""
    from tui.drive.profile import library

    return {None: library.load(profile)} if profile else None
