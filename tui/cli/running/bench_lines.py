"""Lines for the bench of simulated drives: from standard input, a script, and a socket."""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.drive.small_file import read_small_text

from ..documents.other_documents import (
    BenchDocument,
    BenchRefusedDocument,
    BenchStateField,
    BenchWaitsDocument,
    InputsDocument,
)
from ..shared.output import json_text
from ..shared.say import say_beside
from ..shared.standard_streams import given_file

if TYPE_CHECKING:
    from tui.simulator import Bench, BenchResult

STANDARD_INPUT = 0
BYTES_AT_ONCE = 4096
MOST_BYTES_OF_A_LINE = 65536
BACKGROUND_PAUSE = 1.0
"""Seconds between two tries while the terminal belongs to another program."""


def typed_lines() -> Iterator[str]:
    """Lines without their ends, until the input ends; for a thread of its own.

    Reads the handle itself: a buffered stream that waits would hold up the end of the program. In
    the background of a shell it waits until the program is in the foreground.
    """
    rest = b""
    while (data := _read()) != b"":
        *lines, rest = (rest + data).split(b"\n")
        for line in lines:
            yield line.decode("utf-8", "replace").rstrip("\r")
    if rest:
        yield rest.decode("utf-8", "replace")


def _read() -> bytes:
    while True:
        try:
            return os.read(STANDARD_INPUT, BYTES_AT_ONCE)
        except OSError:
            if not os.isatty(STANDARD_INPUT):
                return b""
            time.sleep(BACKGROUND_PAUSE)


def bench_document(result: BenchResult) -> InputsDocument | BenchDocument:
    """Return the document of a result: one of inputs if the line sets or shows inputs only."""
    state = result.state
    drive = BenchStateField(
        powered=state.powered,
        fault=state.fault or None,
        output_hz=round(state.output_hz, 2),
        shaft_hz=round(state.shaft_hz, 2),
        current=round(state.current, 2),
        mains=round(state.mains, 1),
        wire_cut=state.wire_cut,
        jammed=state.jammed,
        planted=list(state.planted),
    )
    if result.inputs:
        text = f"{result.device}: {result.text}"
        return InputsDocument(text=text, time=result.time, device=result.device, drive=drive)
    return BenchDocument(text=result.text, time=result.time, device=result.device, drive=drive)


def answers_to(bench: Bench, line: str) -> list[str]:
    """Carry out a line, and return its results as JSON, one a line; a refusal is one, too."""
    from tui.simulator import SimulatorError

    try:
        results = bench.do(line)
    except SimulatorError as error:
        return [json_text(BenchRefusedDocument(text=line.strip(), error=str(error)))]
    documents = [json_text(bench_document(result)) for result in results]
    return documents or [json_text(BenchWaitsDocument(text=line.strip(), waiting=bench.waiting))]


def follow_input(bench: Bench, as_json: bool) -> None:
    """Carry out the lines of standard input; a wrong line is reported."""
    from tui.simulator import SimulatorError

    for line in typed_lines():
        if line.strip():
            try:
                results = bench.do(line)
            except SimulatorError as error:
                say_beside(str(error), err=True)
                continue
            for result in results:
                say_result(result, as_json)
            if not results:
                waits = BenchWaitsDocument(text=line.strip(), waiting=bench.waiting)
                text = json_text(waits) if as_json else f"{line.strip()} (waits for its time)"
                say_beside(text, as_it_is=as_json)


def say_result(result: BenchResult, as_json: bool) -> None:
    """Print a result."""
    if as_json:
        say_beside(json_text(bench_document(result)), as_it_is=True)
    else:
        say_beside(f"{result.device}: {result.text}")


def script_lines(bench: Bench, path: str) -> list[str]:
    """Return the lines of a script, all checked; text after `#` is a comment. Raises UsageError."""
    from tui.simulator import SimulatorError

    try:
        text = read_small_text(given_file(Path(path)))
    except OSError as error:
        raise click.UsageError(f"{path} cannot be read: {error.strerror or error}.") from None
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        if command := line.partition("#")[0].strip():
            try:
                bench.check(command)
            except SimulatorError as error:
                raise click.UsageError(f"{path}, line {number}: {error}") from None
            found.append(command)
    return found


def run_script(bench: Bench, lines: Sequence[str], as_json: bool) -> None:
    """Carry out the lines of a script that was checked."""
    for line in lines:
        for result in bench.do(line):
            say_result(result, as_json)


class BenchSocket:
    """Socket at a path: each line sent to it is answered by a line of JSON for each drive."""

    def __init__(self, bench: Bench, path: str) -> None:
        """Listen at a path. Raises UsageError if it cannot."""
        self._bench = bench
        self._path = Path(path)
        if not hasattr(socket, "AF_UNIX"):
            raise click.UsageError("This system has no sockets with a path. Use standard input.")
        if self._path.is_socket():
            if _is_served(path):
                raise click.UsageError(f"{path} is in use by another program.")
            self._path.unlink()  # left by a program that was killed
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            before = os.umask(0o177)  # only this user can connect
            try:
                self._listener.bind(path)
            finally:
                os.umask(before)
            self._listener.listen()
        except OSError as error:
            self._listener.close()
            raise click.UsageError(f"{path} cannot be served: {error.strerror}.") from None
        threading.Thread(target=self._accept, name="bench socket", daemon=True).start()

    def close(self) -> None:
        """End the socket and remove its path."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
        self._listener.close()

    def _accept(self) -> None:
        with suppress(OSError):  # closed
            while True:
                client, _ = self._listener.accept()
                threading.Thread(
                    target=self._serve, args=(client,), name="bench client", daemon=True
                ).start()

    def _serve(self, client: socket.socket) -> None:
        with suppress(OSError), client, client.makefile("rb") as lines:
            while data := lines.readline(MOST_BYTES_OF_A_LINE):
                if line := data.decode("utf-8", "replace").strip():
                    answer = "\n".join(answers_to(self._bench, line))
                    client.sendall(f"{answer}\n".encode())


def _is_served(path: str) -> bool:
    """Return True if a program accepts connections at a socket."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(path)
        except OSError:
            return False
        return True
