"""The command `drivepanel`: its subcommands, imported when they are called."""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

import click

import tui
from tui.session.logs import start_logging

from .command_index import COMMANDS
from .shared.errors import plain_errors
from .shared.line_argument import is_line
from .shared.registration import GROUPS
from .shared.typed import note_typed

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

LINE_HELP = """
\b
LINE is one of
  /dev/ttyUSB0  serial:PATH[,BAUD[,FORMAT]]  a serial port; formats 8E1, 8N2
  tcp:HOST[:PORT][,unit=255]                 Modbus TCP; unit= for a gateway of one drive
  rtu-tcp:HOST:PORT                          RTU frames over TCP
  sim:PROFILE[@ADDRESS][,...]                simulated drives
  NAME                                       a line of the settings file
Default: $DRIVEPANEL_LINE.

-v is accepted anywhere. With --json, errors are also printed as JSON on standard output.

\b
Exit status:
    0  done
    1  a difference was found
    2  a usage error: an option, file, code, value or profile
    3  no answer, or a line error
    4  refused by the drive
    5  refused by Drive Panel: nothing was written
    6  ended after something was written; the message names it
   70  internal error; see the log
   74  what was printed is lost, for example because the disk is full
  130  ended by Ctrl-C
"""
AS_JSON = "drivepanel.json"
"""Key of the context for the option --json."""
COMPLETE = "_DRIVEPANEL_COMPLETE"
"""The environment variable by which a shell asks what may be typed."""
VERBOSE = frozenset({"-v", "-vv", "-vvv", "--verbose"})


class Commands(click.Group):
    """Subcommands by name; a LINE instead opens the panel on it."""

    def main(self, *args: Any, **extra: Any) -> Any:
        """Run the command line, or answer a shell that completes."""
        if os.environ.get(COMPLETE):
            from .shared.completion import prepare_completion

            prepare_completion()
        return super().main(*args, **extra)

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Take the arguments apart; `-v` is accepted anywhere among them."""
        end = args.index("--") if "--" in args else len(args)
        as_json = "--json" in args[:end]
        verbose = [arg for arg in args[:end] if arg in VERBOSE]
        rest = [arg for arg in args[:end] if arg not in VERBOSE]
        with plain_errors(as_json=as_json):
            context = super().make_context(
                info_name, [*verbose, *rest, *args[end:]], parent, **extra
            )
        context.meta[AS_JSON] = as_json
        note_typed(context)
        return context

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; every end is reported in a line or two."""
        with plain_errors(as_json=ctx.meta[AS_JSON]):
            return super().invoke(ctx)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the subcommands."""
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A subcommand, imported now; None if there is none of this name."""
        if cmd_name != "panel" and cmd_name not in COMMANDS:
            return None
        module = "panel" if cmd_name == "panel" else COMMANDS[cmd_name][0]
        found: Any = getattr(importlib.import_module(f"tui.cli.commands.{module}"), cmd_name)
        assert isinstance(found, click.Command)
        return found

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The subcommand of the arguments, or the panel on the LINE they begin with."""
        if args[0] in COMMANDS:
            return super().resolve_command(ctx, args)
        if args[0] != "panel" and not is_line(args[0]):
            if ctx.resilient_parsing:
                return None, None, []
            raise click.UsageError(no_such_command(args[0]))
        rest = args[1:] if args[0] == "panel" else args
        return "panel", self.get_command(ctx, "panel"), rest

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Send the panel's own options, given without a LINE, to the panel."""
        if ctx.resilient_parsing and VERBOSE.issuperset(args):
            return super().parse_args(ctx, args)
        own = {"-h", "--help", "--version", *VERBOSE}
        first = next((a for a in args if a not in own or a in ("-h", "--help", "--version")), None)
        if first is None or (first.startswith("-") and first not in own):
            split = args.index(first) if first is not None else len(args)
            args = [*args[:split], "panel", *args[split:]]
        return super().parse_args(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[str]]:
        """Commands, kinds of LINE, and options of the panel, without importing the commands."""
        from click.shell_completion import CompletionItem

        panel = self.get_command(ctx, "panel")
        assert panel is not None
        if incomplete.startswith("-"):
            own = click.Command.shell_complete(self, ctx, incomplete)
            more = panel.shell_complete(click.Context(panel, parent=ctx), incomplete)
            return list({item.value: item for item in (*own, *more)}.values())
        from .shared.completion import complete_line

        names = [
            CompletionItem(name, help=reported) for name, (*_, reported) in sorted(COMMANDS.items())
        ]
        lines = complete_line(ctx, panel.params[0], incomplete)
        return [*(item for item in names if item.value.startswith(incomplete)), *lines]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands by group, without importing them."""
        widest = max(map(len, COMMANDS))
        for group in GROUPS:
            rows = [
                (f"{name:{widest}}", reported)
                for name, (_, heading, reported) in sorted(COMMANDS.items())
                if heading == group
            ]
            if rows:
                with formatter.section(group):
                    formatter.write_dl(rows)


def no_such_command(name: str) -> str:
    """Return the error for a word that is neither a command nor a LINE."""
    from difflib import get_close_matches

    if name in COMMANDS:  # after `panel`
        return f"{name} is a command, not a LINE: type drivepanel {name}."
    near = get_close_matches(name.lower(), COMMANDS, n=1)
    if near:
        return f"{name}: no such command, did you mean {near[0]}?"
    return f"{name}: no such command, and no LINE."


@click.group(
    cls=Commands,
    epilog=LINE_HELP,
    context_settings={"help_option_names": ["-h", "--help"]},
    options_metavar="[OPTIONS]",
    subcommand_metavar="[LINE [-d ADDRESS] | COMMAND ...]",
)
@click.option("-v", "--verbose", count=True, help="Log in more detail.")
@click.version_option(tui.__version__, prog_name="drivepanel")
def main(verbose: int) -> None:
    """Monitor and run variable-speed drives on a Modbus line. Without a command, open the panel."""
    start_logging(verbose)
