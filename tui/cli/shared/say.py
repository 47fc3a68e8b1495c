"""What a command says to a person: text as it is written, never a command to the terminal."""

from __future__ import annotations

import sys

import click

from tui.drive.plain import plain


def say(text: str = "", *, err: bool = False) -> None:
    """Print lines on standard output, or on standard error."""
    stream = sys.stderr if err else sys.stdout
    click.echo(printable(text, stream.encoding), err=err)


def say_over(text: str, *, last: bool) -> None:
    """Print one line on standard error in place of the one before; the last one stays."""
    click.echo(f"\r{printable(text, sys.stderr.encoding)}", err=True, nl=last)


def printable(text: str, encoding: str | None) -> str:
    """The text with its control characters as signs, or `?` where the encoding has none."""
    encoding = encoding or "utf-8"
    return plain(text, lines=True).encode(encoding, "replace").decode(encoding)
