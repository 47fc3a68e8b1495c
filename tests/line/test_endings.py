"""Ends of commands: signals, closed pipes, leftovers."""

from __future__ import annotations

import csv
import io
import json
import os
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from tests.cli.commands import tcp_line
from tests.programs import DRIVEPANEL, PATIENCE, drivepanel, port_of, served, simulated
from tui.cli.shared.output import readings_table
from tui.drive.profile import library
from tui.drive.values import decode
from tui.session.monitor.rates import monitoring_codes
from tui.session.reading import Reading
from tui.session.shown import Quality

WATCH = ("watch", "sim:atv71@2", "-d", "2", "ETA", "--every", "0.1", "--json")
ENDINGS = [signal.SIGINT, signal.SIGTERM]


@pytest.mark.parametrize("ending", ENDINGS)
def test_simulate_ends_cleanly_and_removes_its_link(ending: signal.Signals, tmp_path: Path) -> None:
    link = tmp_path / "line"
    with simulated("atv71@2", "--pty", str(link)) as simulation:
        assert link.is_symlink()
        assert f"serial:{link}" in simulation.ready
        assert simulation.end(ending) == (0, "")
    assert not link.is_symlink()


@pytest.mark.parametrize("way", ["--tcp", "--rtu-tcp"])
def test_simulate_listens_on_loopback_by_default(way: str) -> None:
    with simulated("atv71@2", way, "0") as simulation:
        port = port_of(simulation.ready)
        scheme = way.removeprefix("--")
        done = drivepanel("read", f"{scheme}:127.0.0.1:{port}", "ETA", "-d", "2")
        assert done.returncode == 0, done.stderr
        assert simulation.end() == (0, "")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)


def test_simulate_does_not_replace_a_file(tmp_path: Path) -> None:
    taken = tmp_path / "notes.txt"
    taken.write_text("mine")
    done = drivepanel("simulate", "atv71", "--pty", str(taken))
    assert done.returncode == 2
    assert taken.read_text() == "mine"


def test_simulated_line_faults_are_repeatable() -> None:
    def statuses() -> list[int]:
        faults = ("--line-fault", "lost=0.5", "--seed", "7")
        with tcp_line("atv71@2", *faults) as line:
            read = ("read", line, "ETA", "-d", "2", "-p", "atv71")
            return [drivepanel(*read).returncode for _ in range(4)]

    first = statuses()
    assert set(first) <= {0, 3}
    assert statuses() == first


def test_ctrl_c_ends_watch_after_a_complete_line() -> None:
    with served([*DRIVEPANEL, *WATCH], ready="{") as watching:
        assert set(json.loads(watching.ready)["values"]) == {"ETA"}
        watching.process.send_signal(signal.SIGINT)
        rest, output = watching.process.communicate(timeout=PATIENCE)
    assert watching.process.returncode == 130
    assert output.startswith("drivepanel: Ended by Ctrl-C after ")
    assert rest.endswith("\n")
    reported = [json.loads(line) for line in rest.splitlines()]
    assert reported[-1]["status"] == 130
    assert all("values" in item for item in reported[:-1])


@pytest.fixture
def silent_line() -> Iterator[tuple[socket.socket, str]]:
    """A TCP port that is connected to and never answers, and the LINE to it."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        yield server, f"tcp:127.0.0.1:{server.getsockname()[1]},timeout=30"


INTERRUPTED = {
    "read": (("ETA",), "Ended by Ctrl-C."),
    "backup": (("FILE",), "nothing was written"),
    "report": (("FILE",), "nothing was written"),
    "watch": (("ETA", "--csv", "FILE"), "after 0 cycles; 0 rows"),
    "compare": (("factory",), "Ended by Ctrl-C."),
    "write": (("ACC=5", "--arm"), "may have been written: read it"),
}


@pytest.mark.parametrize("command", INTERRUPTED)
def test_ctrl_c_exits_with_130_and_reports_what_was_written(
    command: str, silent_line: tuple[socket.socket, str], tmp_path: Path
) -> None:
    server, line = silent_line
    words, text = INTERRUPTED[command]
    file = tmp_path / "out"
    typed = [str(file) if word == "FILE" else word for word in words]
    arguments = [*DRIVEPANEL, command, line, *typed, "-p", "atv71"]
    process = subprocess.Popen(
        arguments, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    connection, _ = server.accept()
    with connection:
        connection.settimeout(PATIENCE)
        assert connection.recv(1)  # it asks, so it is at work
        process.send_signal(signal.SIGINT)
        out, output = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (130, "")
    assert output.startswith("drivepanel: Ended by Ctrl-C")
    assert text in output
    if command in ("backup", "report"):
        assert not file.exists()


@pytest.mark.parametrize("command", [WATCH, ("profiles", "atv71"), ("profiles", "atv71", "--json")])
def test_closed_reader_is_not_an_error(command: tuple[str, ...]) -> None:
    process = subprocess.Popen(
        [*DRIVEPANEL, *command],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() != ""
        process.stdout.close()
        output = process.stderr.read()
        status = process.wait(timeout=PATIENCE)
    finally:
        process.kill()
        process.wait(timeout=PATIENCE)
        assert process.stderr is not None
        process.stderr.close()
    assert (status, output) == (0, "")


def test_watch_also_writes_a_csv_file(tmp_path: Path) -> None:
    path = tmp_path / "watch.csv"
    watch = ("watch", "sim:atv71@2", "-d", "2", "RFR", "ETA", "--every", "0.1", "--count", "3")
    done = drivepanel(*watch, "--csv", str(path), "--json")
    assert done.returncode == 0, done.stderr
    with path.open(newline="", encoding="utf-8") as file:
        titles, *rows = csv.reader(file)
    assert titles == ["time", "RFR [Hz]", "ETA", "error", "state", "direction"]
    printed = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row[0] for row in rows] == [cycle["time"] for cycle in printed]
    assert [row[1] for row in rows] == [cycle["values"]["RFR"]["text"] for cycle in printed]


def test_table_shows_the_three_notations() -> None:
    done = drivepanel("read", "sim:atv71@2", "-d", "2", "acc", "rfr")
    assert done.returncode == 0, done.stderr
    row = next(line for line in done.stdout.splitlines() if line.startswith("ACC"))
    for part in ("ACC", "W9001", "9001 (16#2329)", " s "):
        assert part in row


@pytest.mark.parametrize("width", [72, 80, 120])
def test_narrow_terminal_cuts_names_but_never_numbers(width: int) -> None:
    profile = library.load("atv71")
    codes = monitoring_codes(profile)
    readings = {
        code: Reading(profile[code], raw, decode(profile[code], raw, {}, None), Quality.GOOD, 0.0)
        for raw, code in enumerate(codes, start=64000)
    }
    screen = Console(width=width, file=io.StringIO(), color_system=None)
    screen.print(readings_table(readings, "title", width=width))
    assert isinstance(screen.file, io.StringIO)
    lines = screen.file.getvalue().splitlines()
    assert len(lines) == len(codes) + 2
    for code, line in zip(codes, lines[2:], strict=True):
        reading = readings[code]
        for part in (code, str(reading.raw), reading.text, f"(16#{reading.parameter.address:04X})"):
            assert f" {part} " in f" {line} "


def test_panel_is_not_drawn_into_a_file(tmp_path: Path) -> None:
    """With `2>file` the whole panel went into the file, and its keys still worked."""
    output = tmp_path / "said"
    near, far = os.openpty()
    with output.open("w") as file:
        process = subprocess.Popen(
            [*DRIVEPANEL, "demo"], stdin=far, stdout=far, stderr=file, start_new_session=True
        )
        try:
            assert process.wait(PATIENCE) == 2
        finally:
            process.kill()
            os.close(near)
            os.close(far)
    assert "drawn on standard error" in output.read_text("utf-8")
    assert "\x1b" not in output.read_text("utf-8")
