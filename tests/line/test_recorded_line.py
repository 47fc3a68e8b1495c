"""The record of a keeper equals the log of the wire."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from tests.programs import (
    DRIVEPANEL,
    PATIENCE,
    drivepanel,
    end_keepers,
    keepers,
    served,
    wait_until,
)
from tui.session.connect.open_line import open_line
from tui.session.connect.recorded_line import recording_is_on
from tui.simulator import DriveSpec
from tui.simulator.server.answering import Answering

from .test_commands import bench

Exchanges = list[tuple[int, bytes, bytes | None]]
DIAGNOSE = 8
DRIVES = DriveSpec("atv71", 1, run_hz=20, wander=True), DriveSpec("atv21", 2, run_hz=30)


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs of these tests record."""
    monkeypatch.delenv("DRIVEPANEL_RECORD")


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Exchanges:
    """The simulator's own log: each request to a drive of this process, and its reply."""
    log: Exchanges = []
    answer = Answering.answer

    def logged(self: Answering, address: int, pdu: bytes) -> bytes | None:
        reply = answer(self, address, pdu)
        if reply is not None:
            log.append((address, pdu, reply))
        return reply

    monkeypatch.setattr(Answering, "answer", logged)
    return log


def record_files() -> list[Path]:
    return sorted(Path(os.environ["DRIVEPANEL_STATE"], "record").glob("*.sqlite"))


@contextmanager
def record_of_line() -> Iterator[sqlite3.Connection]:
    """The record after the end of the keeper."""
    end_keepers()
    (path,) = record_files()
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
        yield base


def exchanges_in(base: sqlite3.Connection) -> Exchanges:
    """Requests and replies put together again from the columns; None for no reply in time."""
    columns = "device, function, address, registers, quality, words, sent, received"
    rows = base.execute(f"SELECT {columns} FROM reply WHERE quality < 8 ORDER BY id")
    found: Exchanges = []
    for device, function, address, registers, quality, words, sent, received in rows:
        place = address.to_bytes(2, "big") if address is not None else b""
        match function:
            case 3:
                request = bytes([3]) + place + registers.to_bytes(2, "big")
                reply = bytes([3, 2 * registers]) + (words or b"")
            case 6:
                request = reply = bytes([6]) + place + words
            case _:
                request, reply = sent, received
        found.append((device, request, {0: reply, 1: received}.get(quality)))
    return found


def check_record(found: Exchanges, wire: Exchanges, *, lost: int = 0) -> None:
    """The replies of the record are those of the wire, in their order.

    A request without a recorded reply, as a busy machine leaves some, accounts for one that is
    missing; `lost` for those of a killed keeper.
    """
    replied = [item for item in found if item[2] is not None]
    left = iter(wire)
    assert all(item in left for item in replied)
    assert len(wire) - len(replied) <= len(found) - len(replied) + lost


def test_record_of_a_keeper_equals_the_log_of_the_wire(wire: Exchanges) -> None:
    with bench(*DRIVES) as (_, line):
        run = drivepanel("run", line, "-p", "atv71", "--reference", "30Hz", "--arm", "--for", "0.5")
        assert run.returncode == 0, run.stderr
        watch = drivepanel("watch", line, "-d", "1", "-d", "2", "--every", "0.1", "--count", "8")
        assert watch.returncode == 0, watch.stderr
        with record_of_line() as base:
            found = exchanges_in(base)
            check_record(found, wire)
            assert sum(reply is not None for _, _, reply in found) > 50
            assert any(request[0] == 6 for _, request, _ in wire)
            (program,) = base.execute(
                "SELECT DISTINCT name FROM reply JOIN who ON who.id = who WHERE function = 6"
            ).fetchone()
            assert program.startswith("run (pid ")
            events = base.execute(
                "SELECT kind, text, name FROM event LEFT JOIN who ON who.id = who ORDER BY event.id"
            ).fetchall()
            profiles = {
                json.loads(text)["profile"] for kind, text, _ in events if kind == "profile"
            }
            assert profiles == {"atv71", "atv21"}
            assert ("stop", "drivepanel run", program) in events
            assert ("commander", "It commands the drive.", program) in events
            utc, mono = base.execute("SELECT utc, mono FROM reply ORDER BY id").fetchone()
            begun = base.execute("SELECT utc - mono FROM session").fetchone()[0]
            assert abs((utc - mono) - begun) < 500_000


def test_record_of_a_killed_keeper_goes_on_with_the_next_one(wire: Exchanges) -> None:
    with bench(*DRIVES) as (_, line):
        command = [*DRIVEPANEL, "watch", line, "ETA", "-d", "1", "-p", "atv71", "--every", "0.1"]
        with served(command, ready="ETA"):
            (pid,) = keepers()
            wait_until(lambda: len(wire) > 30, "it polls")
            os.kill(pid, signal.SIGKILL)
            wait_until(lambda: keepers() not in ([], [pid]), "the next keeper")
            before = len(wire)
            wait_until(lambda: len(wire) > before + 20, "it polls again")
        with record_of_line() as base:
            sessions = base.execute("SELECT count(*) FROM session").fetchone()[0]
            assert sessions == 2
            found = exchanges_in(base)
            check_record(found, wire, lost=12)  # those of the last second
            assert DIAGNOSE in {request[0] for _, request, _ in found}  # the proof of its step


def test_program_that_holds_the_line_itself_records_it(wire: Exchanges) -> None:
    with bench(*DRIVES) as (_, line):
        opened = open_line(line, wait=PATIENCE, keeper=False, program="script")
        with closing(opened):
            drive = opened.line.spawn(lambda: _read(opened.line), "reads")
            wait_until(lambda: len(wire) == 10, "ten reads")
            del drive
        (path,) = record_files()
        with closing(sqlite3.connect(path)) as base:
            found = exchanges_in(base)
            check_record(found, wire)


async def _read(line: object) -> None:
    for _ in range(10):
        await line.read(1, 3201)  # type: ignore[attr-defined]


def test_nothing_is_recorded_if_it_is_turned_off(monkeypatch: pytest.MonkeyPatch) -> None:
    assert recording_is_on()
    folder = Path(os.environ["DRIVEPANEL_CONFIG"])
    folder.mkdir()
    (folder / "settings.toml").write_text("[record]\non = false\n")
    assert not recording_is_on()
    with bench(*DRIVES) as (_, line):
        assert drivepanel("read", line, "ETA", "-p", "atv71").returncode == 0
        end_keepers()
    assert record_files() == []
    monkeypatch.setenv("DRIVEPANEL_RECORD", "on")
    assert recording_is_on()
    (folder / "settings.toml").unlink()
    monkeypatch.setenv("DRIVEPANEL_RECORD", "off")
    assert not recording_is_on()


def test_keeper_whose_record_cannot_be_written_serves_and_says_so_once(wire: Exchanges) -> None:
    state = Path(os.environ["DRIVEPANEL_STATE"])
    state.mkdir()
    (state / "record").write_text("a file in the place of the folder")
    with bench(*DRIVES) as (_, line):
        done = subprocess.run(
            [*DRIVEPANEL, "watch", line, "ETA", "-d", "1", "-p", "atv71", "--every", "0.1",
             "--count", "20"],
            capture_output=True, text=True, timeout=PATIENCE, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert len(wire) >= 20
        end_keepers()
    log = (state / "drivepanel.log").read_text()
    assert log.count("Nothing is recorded: a file is in the place of a folder") == 1
