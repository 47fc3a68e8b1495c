"""Completions for a shell: lines, profiles, codes. No drive is polled."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar

import click
from click.shell_completion import (
    BashComplete,
    CompletionItem,
    add_completion_class,
    split_arg_string,
)

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile

Items = list[CompletionItem[str]]

KINDS_OF_LINE = {
    "tcp:": "Modbus TCP: tcp:HOST[:PORT]",
    "rtu-tcp:": "RTU over TCP: rtu-tcp:HOST:PORT",
    "serial:": "a serial port with its settings: serial:PATH,BAUD,FORMAT",
    "sim:": "simulated drives: sim:PROFILE[@ADDRESS],...",
}
FILE = CompletionItem("", type="file")


def complete_line(_: click.Context, __: click.Parameter, incomplete: str) -> Items:
    """Names of lines, ports of this machine, the kinds of a LINE; profiles behind `sim:`."""
    kind, colon, rest = incomplete.partition(":")
    if kind.lower() == "sim" and colon:
        before, comma, begun = rest.rpartition(",")
        return [
            CompletionItem(f"{kind}:{before}{comma}{item.value}", help=item.help)
            for item in _profiles(begun)
        ]
    if incomplete.startswith(("/", ".")):
        ports = [item for item in _ports() if item.value.startswith(incomplete)]
        return ports or [CompletionItem(incomplete, type="file")]
    known = [CompletionItem(text, help=what) for text, what in KINDS_OF_LINE.items()]
    every = (*_names(), *_ports(), *known)
    return [item for item in every if item.value.startswith(incomplete)]


def complete_side(context: click.Context, option: click.Parameter, incomplete: str) -> Items:
    """Complete a side of `compare`: a file, a LINE, or the factory."""
    factory = [CompletionItem("factory", help="Compare with the factory settings.")]
    found = [item for item in factory if item.value.startswith(incomplete)]
    return found or complete_line(context, option, incomplete) or [FILE]


def complete_profile(_: click.Context, __: click.Parameter, incomplete: str) -> Items:
    """Ids of the profiles."""
    return _profiles(incomplete)


def complete_code(context: click.Context, _: click.Parameter, incomplete: str) -> Items:
    """Codes of the profile that `-p` names, or of the simulated drive."""
    return _codes(context, incomplete)


def complete_line_or_code(
    context: click.Context, argument: click.Parameter, incomplete: str
) -> Items:
    """Another LINE, or codes."""
    codes = _codes(context, incomplete)
    return [*codes, *complete_line(context, argument, incomplete)]


def complete_setting(context: click.Context, _: click.Parameter, incomplete: str) -> Items:
    """CODE= for what can be written."""
    if "=" in incomplete:
        return []
    return [
        CompletionItem(f"{item.value}=", help=item.help)
        for item in _codes(context, incomplete, writable=True)
    ]


def _ports() -> Iterator[CompletionItem[str]]:
    from tui.bus.transport.ports import list_ports

    yield from (CompletionItem(port.path, help=port.description) for port in list_ports())


def _names() -> Iterator[CompletionItem[str]]:
    from tui.session.connect.named_lines import named_lines

    yield from (CompletionItem(line.name, help=line.line) for line in named_lines().values())


def _profiles(incomplete: str) -> Items:
    from tui.drive.profile import library

    return [
        CompletionItem(listing.id, help=listing.name)
        for listing in (*library.listings(), *library.public_listings())
        if listing.id.startswith(incomplete.lower())
    ]


def _codes(context: click.Context, incomplete: str, *, writable: bool = False) -> Items:
    profile = _profile_of(context)
    if profile is None:
        return []
    return [
        CompletionItem(parameter.code, help=parameter.name)
        for parameter in profile.parameters
        if parameter.code.lower().startswith(incomplete.lower())
        and not (writable and parameter.access == "r")
    ]


def _profile_of(context: click.Context) -> Profile | None:
    """The profile that was typed, with -p or within a simulated LINE; None where none is known."""
    from tui.drive.errors import DriveError
    from tui.drive.profile import library

    named = context.params.get("profile_id") or _simulated(context)
    try:
        return library.load(str(named)) if named else None
    except DriveError:
        return None


def _simulated(context: click.Context) -> str:
    kind, _, drives = str(context.params.get("line_text") or "").partition(":")
    if kind.lower() != "sim":
        return ""
    from tui.simulator import SimulatorError, parse_drives

    given = context.params.get("device") or 1
    device = given[0] if isinstance(given, tuple) else given
    try:
        found = {drive.address: drive.profile for drive in parse_drives(drives)}
    except SimulatorError:
        return ""
    return found.get(device, "")


BREAKS = " \t\n\"'@><=;|&(:"
"""Word breaks of readline if a shell does not report its own."""
KEPT = "@$"
"""Breaks that readline leaves at the beginning of the word."""

_SOURCE = """\
%(complete_func)s() {
    local IFS=$'\\n' response completion type value
    response=$(env COMP_LINE="$COMP_LINE" COMP_POINT="$COMP_POINT" \
COMP_BREAKS="$COMP_WORDBREAKS" %(complete_var)s=bash_complete "$1")
    for completion in $response; do
        type=${completion%%%%,*}
        value=${completion#*,}
        if [[ $type == file || $type == dir ]]; then
            COMPREPLY=()
            compopt -o default
        else
            COMPREPLY+=("$value")
            [[ $value == *[:=,] ]] && compopt -o nospace
        fi
    done
    return 0
}
complete -o nosort -F %(complete_func)s %(prog_name)s
"""


class BashByLine(BashComplete):
    """Takes the line as it was typed, since bash breaks a LINE at its colons."""

    name: ClassVar[str] = "bash"
    source_template: ClassVar[str] = _SOURCE

    def get_completion_args(self) -> tuple[list[str], str]:
        """The whole words before the cursor, and the one at it."""
        typed, point = os.environ.get("COMP_LINE", ""), os.environ.get("COMP_POINT", "")
        # the point is empty where something else than a shell's own line asks
        typed = typed[: int(point)] if point.isdecimal() else typed
        words = split_arg_string(typed)
        incomplete = words.pop() if words and not typed[-1:].isspace() else ""
        return words[1:], incomplete

    def format_completion(self, item: CompletionItem[str]) -> str:
        """Kind and value; of the value what bash takes for the word: behind the last break."""
        _, incomplete = self.get_completion_args()
        breaks = os.environ.get("COMP_BREAKS") or BREAKS
        places = ((incomplete.rfind(sign), sign not in KEPT) for sign in breaks)
        kept = max((at + behind for at, behind in places if at >= 0), default=0)
        return f"{item.type},{item.value[kept:]}"


def prepare_completion() -> None:
    """Know the shells; called where one asks."""
    add_completion_class(BashByLine)
