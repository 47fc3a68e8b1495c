"""LINE on the command line: written out, a name from the settings file, or omitted.

If it is omitted, the variable DRIVEPANEL_LINE is used. A name includes the address and the profile
of its drive; -d and -p override them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, MutableMapping
from typing import TYPE_CHECKING, Any

import click

from .completion import complete_line
from .say import say

if TYPE_CHECKING:
    from tui.session.connect.named_lines import NamedLine
    from tui.session.connect.open_line import OpenLine

_NAME = re.compile(r"[A-Za-z][\w-]*")
_KINDS = re.compile(r"(?:serial|tcp|rtu-tcp|sim):.*|COM\d+(?:,.*)?", re.IGNORECASE | re.DOTALL)


def is_line(text: str) -> bool:
    """Return True if a word is meant for a LINE, rightly written or not: a kind, a path, a port."""
    path = text.partition(",")[0]
    if is_written_out(text) or os.path.exists(path):
        return True
    return is_known_name(text, doubtful=True)


def is_written_out(text: str) -> bool:
    """Return True if a word is a LINE by its signs alone, as no code of a parameter is."""
    return bool(_KINDS.fullmatch(text)) or "/" in text or "\\" in text


def is_known_name(text: str, *, doubtful: bool = False) -> bool:
    """Return True if the settings file names a line so; `doubtful`: or may do, as it has faults."""
    if not _NAME.fullmatch(text):
        return False  # the file need not be looked at
    from tui.session.connect.named_lines import is_name, line_settings

    settings = line_settings()
    return text.casefold() in settings.lines or bool(doubtful and settings.faults and is_name(text))


LINE_VARIABLE = "DRIVEPANEL_LINE"
GROUP_SETTING = "DRIVEPANEL_SHARE_GROUP"
"""Environment variable: the group of users that may attach to lines opened from here."""
_ACCEPTED = "drivepanel.accept-line"
_WRITTEN_OUT = re.compile(
    r"(?:serial|tcp|rtu-tcp|sim):|/dev/|\\\\\.\\|COM\d+(?:,|$)", re.IGNORECASE
)
_FILE_OR_LINE = re.compile(r"[/\\:]")
_STOP = "stop"
"""The command that no settings file keeps from its work."""


class LineArgument(click.Argument):
    """The LINE of a command; taken apart before every option, as a name decides about some."""

    def __init__(self, *names: Any, **attrs: Any) -> None:
        super().__init__(*names, is_eager=True, envvar=LINE_VARIABLE, **attrs)

    def consume_value(self, ctx: click.Context, opts: Mapping[str, Any]) -> Any:
        """The LINE, or that of the environment if it is omitted."""
        if isinstance(opts, MutableMapping) and self._is_left_out(ctx, opts):
            self._shift(ctx, opts)
        return super().consume_value(ctx, opts)

    def process_value(self, ctx: click.Context, value: Any) -> Any:
        """The LINE that is meant, written out."""
        text = super().process_value(ctx, value)
        if not isinstance(text, str) or (ctx.resilient_parsing and not is_known_name(text)):
            return text
        return _resolved(ctx, text)

    def is_line(self, text: str) -> bool:
        """Return True if a word is surely meant for this argument."""
        return bool(_WRITTEN_OUT.match(text)) or is_known_name(text)

    def _others(self, ctx: click.Context) -> list[click.Argument]:
        return [
            param
            for param in ctx.command.params
            if isinstance(param, click.Argument) and param is not self
        ]

    def _is_left_out(self, ctx: click.Context, opts: Mapping[str, Any]) -> bool:
        """Return True if the word in its place belongs to the arguments that follow."""
        text = opts.get(self.name or "")
        if not isinstance(text, str) or self.resolve_envvar_value(ctx) is None:
            return False
        others = self._others(ctx)
        if not others or self.is_line(text):
            return False
        if any(other.required and not _given(opts.get(other.name or "")) for other in others):
            return True
        # one more word would fit: it is a line where it looks like one
        return any(other.nargs < 0 or not other.required for other in others) and not (
            _FILE_OR_LINE.search(text)
        )

    def _shift(self, ctx: click.Context, opts: MutableMapping[str, Any]) -> None:
        """Shift each word to the next argument."""
        words: list[str] = [opts.pop(self.name or "")]
        others = self._others(ctx)
        for other in others:
            held = opts.pop(other.name or "", None)
            words += held if isinstance(held, tuple) else [held] if _given(held) else []
        for other in others:
            if other.nargs < 0:
                opts[other.name or ""] = tuple(words)
                return
            if words:
                opts[other.name or ""] = words.pop(0)
        if words:
            ctx.fail(f"Got unexpected extra argument ({' '.join(words)})")


def _given(value: object) -> bool:
    return isinstance(value, str) or (isinstance(value, tuple) and bool(value))


def _resolved(ctx: click.Context, text: str) -> str:
    """The LINE of a name, whose drive becomes the usual one; any other text as it is."""
    named = named_line_of(text, stops=ctx.command.name == _STOP)
    if named is None:
        return text
    usual = dict(ctx.default_map or {})
    if named.device is not None:
        usual |= {"device": (named.device,), "devices": (named.device,)}
    if named.profile is not None:
        usual["profile_id"] = lambda: _profile_here(ctx, named)
        device_prefix = "" if named.device is None else f"{named.device}="
        usual["profile_ids"] = (f"{device_prefix}{named.profile}",)
    names = {param.name for param in ctx.command.params}
    ctx.default_map = {key: item for key, item in usual.items() if key in names}
    return named.line


def named_line_of(text: str, *, stops: bool = False) -> NamedLine | None:
    """The line of a name, or None for a text that is none. Raises SettingsError as a usage error.

    A stop reports an error in the file, and works around it if possible.
    """
    from tui.session.connect import named_lines

    if not named_lines.is_name(text):
        return None
    try:
        found = named_lines.line_to_stop(text) if stops else named_lines.line_named(text)
    except named_lines.SettingsError as error:
        raise click.UsageError(str(error)) from error
    settings = named_lines.line_settings()
    if found is None and settings.lines and not os.path.exists(text):
        names = ", ".join(line.name for line in settings.lines.values())
        raise click.UsageError(f"{text!r} is not a LINE or a name from {settings.path} ({names}).")
    if found is not None and text.casefold() not in settings.lines:
        for fault in settings.faults:
            say(f"drivepanel: {fault}", err=True)
    return found


def _profile_here(ctx: click.Context, named: NamedLine) -> str | None:
    """The profile of a name, for the drive that it names and no other."""
    if ctx.params.get("every"):
        return None
    given = ctx.params.get("devices") or ctx.params.get("device") or ()
    devices = given if isinstance(given, tuple) else (given,)
    if named.device is not None and any(device != named.device for device in devices):
        return None
    return _usable(named) if ctx.command.name == _STOP else named.profile


def _usable(named: NamedLine) -> str | None:
    """Its profile; None if it is broken, so that the drive's identity decides."""
    from tui.drive.errors import DriveError
    from tui.drive.profile import library

    try:
        library.load(named.profile or "")
    except DriveError as error:
        say(f"drivepanel: {error}", err=True)
        return None
    return named.profile


def _note_accepted(ctx: click.Context, _option: click.Parameter, value: bool) -> None:
    if value:
        ctx.meta[_ACCEPTED] = True


_accept_option = click.option(
    "--accept-line",
    is_flag=True,
    expose_value=False,
    callback=_note_accepted,
    help="Accept a changed line: another adapter or other drives.",
)


def _note_group(_ctx: click.Context, _option: click.Parameter, group: str | None) -> None:
    if group:
        os.environ[GROUP_SETTING] = group  # where the environment of a service says it, too


share_group_option = click.option(
    "--share-group",
    metavar="GROUP",
    expose_value=False,
    callback=_note_group,
    help="Share the line with users of this group (default: only you).",
)


def takes_line_as(
    kind: type[LineArgument], metavar: str
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """LINE, with the options to accept a changed line and to share it with a group."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        argument = click.argument(
            "line_text", metavar=metavar, cls=kind, shell_complete=complete_line
        )
        return argument(line_options(command))

    return decorate


def line_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of any LINE: accept it as it is now, and share it with a group."""
    return _accept_option(share_group_option(command))


def mind_the_line(opened: OpenLine) -> None:
    """Compare an open line with what is remembered of it; nothing keeps a stop from its work."""
    ctx = click.get_current_context(silent=True)
    if opened.simulation is not None or (ctx is not None and ctx.command.name == _STOP):
        return
    from tui.session.connect.known_line import KnownLine

    opened.known = KnownLine(opened.line)
    if ctx is not None and ctx.meta.get(_ACCEPTED):
        opened.known.accept(all_that_comes=True)
    tell_changes(opened, ())


def tell_changes(opened: OpenLine, before: tuple[str, ...]) -> None:
    """Report changes of the line that are not in `before`; a refusal includes them."""
    ctx = click.get_current_context(silent=True)
    if opened.known is None or (ctx is not None and ctx.params.get("arm")):
        return
    new = [text for text in opened.known.changed if text not in before]
    if new:
        say(f"drivepanel: {' '.join(new)} {opened.known.way}", err=True)


def mind_the_drive(opened: OpenLine, device: int, identity: Any, profile: str = "") -> None:
    """Compare a drive with the one that is remembered at its address."""
    if opened.known is not None:
        before = opened.known.changed
        opened.known.note(identity, device, profile)
        tell_changes(opened, before)
