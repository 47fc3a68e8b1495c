"""The manual page, made of the help of the commands. `python -m tui.cli.derived` writes it."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click

import tui

from .main import main
from .shared.registration import RegisteredCommand

NAME = "drivepanel"
_LINE_HELP, _, _STATUSES = (main.epilog or "").partition("Exit status:")

FILES = (
    ("$XDG_CONFIG_HOME/drivepanel/settings.toml", "Names of lines."),
    ("$XDG_CONFIG_HOME/drivepanel/profiles/", "Profiles of your own."),
    ("$XDG_STATE_HOME/drivepanel/journal.jsonl", "The journal of writes to drives."),
    ("$XDG_STATE_HOME/drivepanel/drivepanel.log", "The log."),
)
VARIABLES = (
    ("DRIVEPANEL_LINE", "The default LINE, or its name."),
    ("DRIVEPANEL_CONFIG", "The configuration folder (default: in $XDG_CONFIG_HOME)."),
    ("DRIVEPANEL_STATE", "The state folder (default: in $XDG_STATE_HOME)."),
    ("DRIVEPANEL_MQTT_PASSWORD", "The password for the MQTT broker of serve and publish."),
    ("NO_COLOR", "Draw without colors."),
)
CAUTION = (
    "The panel is not a safety device: use the emergency stop of the machine. Run commands turn"
    " motors. Nothing is written without --arm, except for stops, which do not need it."
)


def man_page() -> str:
    """The whole page, as roff with the macros of man(7)."""
    top = click.Context(main, info_name=NAME, **main.context_settings)
    panel = main.get_command(top, "panel")
    assert panel is not None
    parts = [
        f'.TH {NAME.upper()} 1 "" "{NAME} {tui.__version__}" "User Commands"',
        *_section("NAME", f"{NAME} \\- {_text('panel and commands for drives on a Modbus line')}"),
        *_section("SYNOPSIS", *_usage(NAME, "[OPTIONS] [LINE [-d ADDRESS]]")),
        *_usage(NAME, "COMMAND [OPTIONS] ..."),
        *_section("DESCRIPTION", *_paragraphs(main.help or "")),
        ".PP",
        *_paragraphs(_LINE_HELP),
        *_section("OPTIONS", *_options(main, top)),
        *_section("OPTIONS OF THE PANEL", *_options(panel, top)),
        *_section("COMMANDS"),
    ]
    for name in main.list_commands(top):
        parts += _command(name, top)
    parts += _section("EXIT STATUS", *_statuses())
    parts += _section("ENVIRONMENT", *_list(VARIABLES))
    parts += _section("FILES", *_list(FILES))
    parts += _section("CAUTION", *_paragraphs(CAUTION))
    return "\n".join(parts) + "\n"


def _command(name: str, top: click.Context) -> Iterator[str]:
    command = main.get_command(top, name)
    assert command is not None
    context = click.Context(command, info_name=name, parent=top)
    usage = " ".join(command.collect_usage_pieces(context))
    yield f".SS {_text(name)}"
    yield from _usage(f"{NAME} {name}", usage)
    yield ".PP"
    yield from _paragraphs(command.help or "")
    yield from _options(command, context)
    if isinstance(command, RegisteredCommand):
        yield ".PP"
        yield _text(f"Exit status: {', '.join(map(str, command.all_statuses))}.")


def _usage(command: str, arguments: str) -> Iterator[str]:
    yield f".B {_text(command)}"
    yield _text(arguments)
    yield ".br"


def _options(command: click.Command, context: click.Context) -> Iterator[str]:
    records = (param.get_help_record(context) for param in command.get_params(context))
    return _list([record for record in records if record is not None and record[1]])


def _list(rows: list[tuple[str, str]] | tuple[tuple[str, str], ...]) -> Iterator[str]:
    for name, about in rows:
        yield ".TP"
        yield f".B {_text(name)}"
        yield _text(" ".join(about.split()))


def _statuses() -> Iterator[str]:
    """The table of the epilog, a status each; unchanged except in a table."""
    rows = re.findall(r"^\s*(\d+)\s+(.+)$", _STATUSES, re.MULTILINE)
    return _list(rows) if len(rows) > 1 else _paragraphs(_STATUSES)


def _section(title: str, *lines: str) -> list[str]:
    return [f".SH {title}", *lines]


def _paragraphs(text: str) -> Iterator[str]:
    r"""Texts of click: paragraphs separated by blank lines, one that begins with \b unchanged."""
    for number, part in enumerate(re.split(r"\n\s*\n", text.strip())):
        if number:
            yield ".PP"
        if part.lstrip().startswith("\b"):
            rows = part.lstrip().removeprefix("\b").strip("\n").split("\n")
            yield from (".nf", *(_text(row) for row in rows), ".fi")
        else:
            yield _text(" ".join(part.split()))


def _text(text: str) -> str:
    """A text that roff takes as it is."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("\b", "")
    return f"\\&{text}" if text.startswith((".", "'")) else text
