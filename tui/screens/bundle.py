"""The action that makes a bundle: which line, which file, and the screens as they are now."""

from __future__ import annotations

from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tui.bus.errors import LinkSyntaxError
from tui.bus.link import parse_link
from tui.session.paths import state_folder
from tui.terminal.lean import screen_text

from .dialogs.ask import Ask
from .dialogs.files import fault_of_new

if TYPE_CHECKING:
    from tui.bus.errors import LineError
    from tui.bus.link import Link
    from tui.drive.profile.profile import Profile
    from tui.session.bundle.archive import Bundle
    from tui.session.bundle.parts import PartProgress
    from tui.session.bundle.subject import BundleSubject
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet

    from .app_port import Panel

NO_LINE_CHOSEN = "Choose a line on Line first. A simulated line must be open for a bundle."
ABOUT_BUNDLE = (
    "Port, diagnosis, frames, settings, journal, log and screens of this line. User names, host"
    " names and passwords are omitted. Drives are only read."
)


def ask_bundle(app: Panel) -> None:
    """Ask for the name of the file; then collect what goes into it."""
    find_target = getattr(app.screen, "why_target_now", None)
    target = find_target() if find_target is not None else None
    opened = target.opened if target is not None else app.opened
    text = target.text if target is not None else app.line_text
    try:
        link = opened.line.link if opened is not None else parse_link(text) if text else None
    except LinkSyntaxError:
        link = None
    if link is None:
        app.tell(NO_LINE_CHOSEN)
        return
    trouble = target.trouble if target is not None else None
    subject = partial(_subject, app, text, link, opened, trouble, _screens(app))
    from tui.session.bundle.subject import bundle_name

    simulated = opened is not None and opened.simulation is not None
    stem = bundle_name(None if simulated else link, datetime.fromtimestamp(app.clock.wall()))
    dialog = Ask(
        "Save the bundle as",
        fault_of_new,
        text=str(state_folder() / f"{stem}.zip"),
        about=ABOUT_BUNDLE,
        takes="Make the bundle",
    )

    def answered(answer: str | None) -> None:
        from .dialogs.bundle import BundleScreen

        if answer:
            path = Path(answer).expanduser()
            app.push_screen(BundleScreen(path, partial(_made, subject(), stem)))

    app.push_screen(dialog, answered)


async def _made(subject: BundleSubject, stem: str, progress: PartProgress) -> Bundle:
    from tui.session.bundle.work import make_bundle

    return await make_bundle(subject, stem, progress)


def _screens(app: Panel) -> dict[str, str]:
    """The screens below dialogs as text, by name, the lowest first."""
    return {
        str(screen.TITLE).lower(): screen_text(screen)
        for screen in app.screen_stack
        if screen.TITLE and not screen.is_modal
    }


def _subject(
    app: Panel,
    text: str,
    link: Link,
    opened: OpenLine | None,
    trouble: LineError | None,
    screens: dict[str, str],
) -> BundleSubject:
    from tui.session.bundle.line_parts import remembered_devices
    from tui.session.bundle.parts import Missing
    from tui.session.bundle.subject import BundleSubject
    from tui.session.diagnosis.asking import profile_remembered

    here = app.open_line_of(text)
    fleet: Fleet | None = here.fleet if here is not None else None

    def expected(device: int) -> Profile | None:
        console = fleet.console(device) if fleet is not None else None
        return console.session.profile if console else profile_remembered(link, device)

    async def open_drive(device: int) -> DriveSession:
        console = fleet.console(device) if fleet is not None else None
        if console is None:
            raise Missing(f"The panel has not identified drive {device}.")
        return console.session

    found = tuple(fleet.found) if fleet is not None else ()
    return BundleSubject(
        text=text,
        link=link,
        opened=opened,
        trouble=trouble,
        devices=found or remembered_devices(link) or (1,),
        open_drive=open_drive,
        documents=app.drive_documents(),
        expected_profile=expected,
        events=app.events.events,
        screens=screens,
    )
