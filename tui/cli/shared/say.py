"""Output of a command for a person: plain text, never a control sequence."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from shutil import get_terminal_size

import click

from tui.drive.plain import plain


def say(text: str = "", *, err: bool = False, indent: int = 0, to_copy: bool = False) -> None:
    """Print lines on standard output or standard error, wrapped at words on a terminal.

    Continuation lines are indented by `indent` characters. Text `to_copy` is not wrapped.
    """
    click.echo(_laid_out(text, err=err, indent=indent, to_copy=to_copy), err=err)


def say_beside(text: str, *, err: bool = False, as_it_is: bool = False) -> None:
    """Print lines from a second thread; output that no reader accepts is lost.

    Bypasses Python's buffers: a thread that waits there holds their lock, and Python aborts a
    program that ends in that time. Text `as_it_is` is for other programs.
    """
    stream = sys.stderr if err else sys.stdout
    reported = text if as_it_is else _laid_out(text, err=err)
    line = f"{reported}{os.linesep}".encode(stream.encoding or "utf-8", "replace")
    with suppress(OSError):
        while line:
            line = line[os.write(stream.fileno(), line) :]


def _laid_out(text: str, *, err: bool, indent: int = 0, to_copy: bool = False) -> str:
    stream = sys.stderr if err else sys.stdout
    width = get_terminal_size().columns if stream.isatty() and not to_copy else 0
    reported = printable(text, stream.encoding)
    return "\n".join(_broken(line, width, indent) for line in reported.split("\n"))


def _broken(line: str, width: int, indent: int) -> str:
    """A line broken at its last words that fit; one that fits, or goes to a file, as it is."""
    if len(line) <= width // 2 or width <= 2 * indent:
        return line
    from rich.cells import cell_len

    if cell_len(line) <= width:
        return line
    parts, rest, gap = [], line, ""
    while cell_len(gap + rest) > width:
        room = width - len(gap)
        at = rest.rfind(" ", 0, room + 1)
        if not rest[: max(at, 0)].strip():
            at = room  # a word longer than the line
        parts.append(gap + rest[:at].rstrip())
        rest, gap = rest[at:].lstrip(), " " * indent
    return "\n".join([*parts, gap + rest])


def say_over(text: str, *, last: bool, before: int = 0) -> None:
    """Replace the last line on standard error; the `last` one stays.

    `before` is the length of the replaced line in characters.
    """
    click.echo(f"\r{printable(text, sys.stderr.encoding):<{before}}", err=True, nl=last)


def say_prompt(text: str) -> None:
    """Print a question on standard error; the answer is typed behind it."""
    click.echo(f"{printable(text, sys.stderr.encoding)} ", err=True, nl=False)


def printable(text: str, encoding: str | None) -> str:
    """The text with its control characters as signs, or `?` where the encoding has none."""
    encoding = encoding or "utf-8"
    return plain(text, lines=True).encode(encoding, "replace").decode(encoding)


class Messages:
    """Sentences of one command; with `as_json` standard output is kept free of them."""

    def __init__(self, *, as_json: bool) -> None:
        self.as_json = as_json
        self.texts: list[str] = []

    def tell(self, text: str, *, indent: int = 0) -> None:
        """Report a notice; continuation lines are indented by so many columns."""
        self.texts.append(text)
        if not self.as_json:
            say(text, indent=indent)

    def complain(self, text: str) -> None:
        """Report a problem; on standard error in any case."""
        self.texts.append(text)
        say(f"drivepanel: {text}", err=True)
