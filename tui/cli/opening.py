"""Opening the panel itself; what parses a command line is not needed here."""

from __future__ import annotations

import gc
import os
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from tui.session.logs import start_logging
from tui.session.signals import BY_SIGNAL

from .shared.signals import ending_by_signal, never_suspended

if TYPE_CHECKING:
    from tui.session.bundle.subject import DriveDocuments
    from tui.session.connect.open_line import OpenLine


def alone() -> None:
    """Open the panel; every failure is reported as by other commands."""
    gc.disable()  # until the first picture
    try:
        start_logging(0)
        if not terminal_trouble():
            sys.exit(open_panel(None, None))
    except (Exception, KeyboardInterrupt) as error:
        _tell(error)
    from .main import main

    main(prog_name="drivepanel")


def _tell(error: BaseException) -> None:
    """Report an error and end with its status."""
    import click

    from .shared.errors import reported

    @click.command()
    @reported
    def failed() -> None:
        raise error

    failed(args=[], prog_name="drivepanel")


STOP, LEAVE_RUNNING = "stop", "leave-running"

YOUNGEST = 10_000
"""New objects after which garbage is looked for; a look holds up what a key does."""

DEMO_LINE = "demo"
"""The LINE of the demo inside the panel; every other text is opened as it is written."""


CANNOT_DRAW = ("", "dumb", "unknown")
"""Terminals on which the drawing library sends nothing at all."""


def open_panel(
    start: str | None,
    device: int | None,
    *,
    read_only: bool = False,
    low_bandwidth: bool = False,
    on_hangup: str = STOP,
    mouse: bool = False,
    bell: bool = True,
    ascii: bool | None = None,
) -> int:
    """Run the panel until it is left; the exit status."""
    gc.disable()  # until the first picture: what is imported and built for it stays
    os.environ.setdefault("TEXTUAL_ANIMATIONS", "none")  # read when textual is first imported
    from tui.app import DrivePanelApp
    from tui.session.connect.open_line import open_line
    from tui.terminal.abilities import abilities_of, fewer_colors, given_environment
    from tui.terminal.loop import soon_in_loop

    abilities = abilities_of(
        given_environment(os.environ), written_as=sys.stderr.encoding, ascii=ascii
    )
    if os.environ.get("TERM", "") in CANNOT_DRAW:
        os.environ["TERM"] = "vt100"  # what draws would send nothing; its abilities are known
    app = DrivePanelApp(
        open_line=_open_with_demo if start == DEMO_LINE else open_line,
        start=start,
        device=device,
        read_only=read_only,
        low_bandwidth=low_bandwidth,
        leave_running=on_hangup == LEAVE_RUNNING,
        mouse=mouse,
        bell=bell,
        abilities=fewer_colors(abilities) if low_bandwidth else abilities,
        on_shown=collect_garbage,
        drive_documents=_drive_documents,
    )

    def tell(text: str) -> None:
        soon_in_loop(app, app.tell, f"{text} Press q to quit.")

    _come_to_the_front()
    with never_suspended(tell), ending_by_signal(app, stop=on_hangup == STOP) as came:
        app.run()
    return BY_SIGNAL + came[0] if came else app.return_code or 0


def _drive_documents() -> DriveDocuments:
    """Import and return the JSON documents of drives."""
    from .shared.diagnosis_documents import drive_documents

    return drive_documents()


def _come_to_the_front() -> None:
    """Wait in the background of a shell: the system suspends a program that sets its terminal."""
    try:
        import termios
    except ImportError:  # Windows
        return
    with suppress(termios.error):
        termios.tcsetattr(0, termios.TCSANOW, termios.tcgetattr(0))


def _open_with_demo(
    text: str, *, read_only: bool = False, wait: float | None = None, program: str = ""
) -> OpenLine:
    """The demo's line, or any other that is chosen in the panel afterwards."""
    from tui.session.connect.open_line import demo_line, open_line

    if text == DEMO_LINE:
        from tui.drive.profile.library import demo_drives

        return demo_line({id: hertz for id, (_, hertz) in demo_drives().items()})
    return open_line(text, read_only=read_only, wait=wait, program=program)


def collect_garbage() -> None:
    """Collect garbage again, less often than usual, and skip the objects that exist now."""
    gc.freeze()
    gc.set_threshold(YOUNGEST, *gc.get_threshold()[1:])
    gc.enable()


def terminal_trouble() -> str:
    """Why the panel cannot be drawn here, or nothing."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return "The panel needs a terminal. Without one, use read, watch or --help."
    if not sys.stderr.isatty():
        return "The panel is drawn on standard error: leave away what leads that elsewhere (2>)."
    return ""
