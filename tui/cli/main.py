"""The command `drivepanel`: its subcommands, imported when they are called."""

from __future__ import annotations

import importlib
from typing import Any

import click

import tui

from .shared.errors import plain_usage
from .shared.logs import start_logging

COMMANDS = {
    "backup": ("backup", "Write every parameter of a drive to a file."),
    "block": ("block", "Show or change a drive's indirect blocks or scanner."),
    "compare": ("compare", "Compare the settings of files, drives, or the factory."),
    "demo": ("panel", "Open the panel on five simulated, running drives."),
    "hold": ("hold", "Ask drives on, against their communication time-out."),
    "identify": ("identify", "Ask a drive who it is."),
    "ports": ("ports", "List the serial ports of this machine."),
    "profiles": ("profiles", "List the profiles, show one, or check a file."),
    "read": ("read", "Read parameters of a drive."),
    "reference": ("orders", "Give a drive its reference."),
    "report": ("report", "Write a report on a drive to a file."),
    "reset": ("orders", "Reset a drive's fault."),
    "restore": ("restore", "Bring a parameter set back into a drive."),
    "run": ("run", "Run a motor until this command is ended."),
    "simulate": ("simulate", "Serve simulated drives."),
    "status": ("status", "Tell what a drive does and who commands it."),
    "stop": ("stop", "Stop a drive, or every drive of a line."),
    "teach": ("teach", "Teach a raw value's scale by the drive's display."),
    "watch": ("watch", "Watch parameters of a drive."),
    "write": ("write", "Write settings of a drive."),
}

LINE_HELP = """
LINE is serial:PATH[,BAUD[,FORMAT]] or a device path, tcp:HOST[:PORT], rtu-tcp:HOST:PORT, or
sim:PROFILE[@ADDRESS][,...] for simulated drives. Formats are written 8E1, 8N2.

Exit status: 0 done, 2 usage, 3 no answer or line trouble, 4 the drive refused, 5 refused here.
"""


class Commands(click.Group):
    """Subcommands by name; anything else is the LINE on which the panel opens."""

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Take the arguments apart; usage errors in two lines."""
        with plain_usage():
            return super().make_context(*args, **kwargs)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; usage errors in two lines."""
        with plain_usage():
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
        rest = args[1:] if args[0] == "panel" else args
        return "panel", self.get_command(ctx, "panel"), rest

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Send the panel's own options, given without a LINE, to the panel."""
        own = {"-h", "--help", "--version", "-v", "-vv", "--verbose"}
        first = next((a for a in args if a not in own or a in ("-h", "--help", "--version")), None)
        if first is None or (first.startswith("-") and first not in own):
            split = args.index(first) if first is not None else len(args)
            args = [*args[:split], "panel", *args[split:]]
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the subcommands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name][1]) for name in self.list_commands(ctx)])


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
    """Watch variable-speed drives on a Modbus line. Without a command the panel opens."""
    start_logging(verbose)
