"""`drivepanel report`: identity, settings and journal of a drive as Markdown."""

from __future__ import annotations

from pathlib import Path

import click

from ..shared.errors import told
from ..shared.options import Target, line_argument, settings_options
from ..shared.say import say
from ..shared.sets import (
    file_argument,
    force_option,
    refuse_existing,
    set_of_drive,
    write_down,
)


@click.command()
@line_argument
@file_argument
@force_option
@settings_options
@told
def report(target: Target, file: Path, force: bool) -> None:
    """Write a report on a drive to FILE, as Markdown.

    What it is, its line settings, settings changed from the factory, who commands it, scanner,
    what it does on a silent line, its faults, and what was written to it from here.
    """
    from tui.session.journal import Journal
    from tui.session.journal_reading import entries_of
    from tui.session.report import report_text as text_of

    refuse_existing(file, force=force)
    session, values = set_of_drive(target)
    entries = entries_of(Journal(), session.line_text, target.device)
    write_down(file, text_of(session.profile, values, entries), force=force)
    say(f"{file}: report on {session.profile.name} at address {target.device}")
