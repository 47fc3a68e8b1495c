"""Files derived from the registrations of commands are as committed."""

from __future__ import annotations

from pathlib import Path

import click

from tui.cli import command_index
from tui.cli import derived as tui_derived
from tui.cli.command_index import COMMANDS
from tui.cli.derived import registered, with_table
from tui.cli.main import main

MAKE = "python -m tui.cli.derived"
PAGE = Path(__file__).resolve().parents[2] / "docs" / "cli.md"


def test_index_of_commands_is_up_to_date() -> None:
    committed = Path(command_index.__file__).read_text("utf-8")
    assert committed == tui_derived.command_index(), MAKE


def test_table_of_commands_is_up_to_date() -> None:
    page = PAGE.read_text("utf-8")
    assert page == with_table(page), MAKE
    assert with_table(page.replace("| [backup]", "| [other]")) == page


def test_every_command_is_registered_under_its_name() -> None:
    context = click.Context(main)
    for name in COMMANDS:
        assert main.get_command(context, name) is registered()[name]


def test_only_commands_that_write_have_status_6() -> None:
    found = {name for name, command in registered().items() if 6 in command.statuses}
    assert {"run", "reference", "reset", "restore", "write", "stop", "block"} <= found
    assert not found & {"read", "watch", "status", "identify", "scan", "hold", "why", "listen"}
