"""The simulated line of `chaos`, in a process that outlives every program on it, and its record.

The record is the simulator's own: each command word on the wire, and 20 times a second how fast
the motor turns. So nothing that is measured comes from the programs under test.
"""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from benchmarks.hands_ends import STOP_WORDS
from benchmarks.terminal import Picture
from benchmarks.wire import Worker
from tests.answering import read_answering
from tests.line.pty_panel import COLUMNS, COMMAND, LINE_SETTLED, ROWS, RUN, start_panel
from tests.programs import DRIVEPANEL, is_running, wait_until
from tui.simulator import DriveSpec, LineTiming, Simulation
from tui.simulator.server.client_settings import ClientSettings
from tui.simulator.server.conversation import PendingReply, SimulatedLine
from tui.simulator.server.frames import is_sealed

COUNTER, STEP = "PTH", 0.05
"""A word of drive 2 that counts steps of so many seconds."""
TIMEOUT = 5.0
"""Communication timeout of drive 1, which has the motor, in s."""
CONSTANTS = {1: {"DEC": 30, "ACC": 31}, 2: {"DEC": 77, "ACC": 123}}
"""Raw values that never change, by device; no two are alike."""
EVERY = 0.5
"""Cycle time of the observer in s."""
FRESH, LONGEST_CYCLE = 1.5, EVERY + 2.0
"""Seconds that a good value may be older than its time, and its time than its cycle."""
ENDS = 30.0
"""Seconds in which a program must end on request."""
LEFT = 15.0
"""Seconds that processes have to end after the last program."""
ROUND_SETTING = "CHAOS_ROUND"
"""Environment variable of all programs of a round, and of their keepers: its folder."""
OUTSIDE = ("runuser", "unshare")
"""Commands that wait for the program that they have started in another place."""
TURNS = 0.5
"""Frequency in Hz above which a motor counts as turning."""


@dataclass(frozen=True, slots=True)
class Moment:
    """State of the motor at a wall-clock time."""

    at: float
    hertz: float
    fault: bool
    count: int


@dataclass(frozen=True, slots=True)
class LineRecord:
    """Record of the line; wall-clock times, which the JSON of programs has too."""

    commands: list[tuple[float, int]]
    """Each command word to drive 1, and when its frame was whole."""
    moments: list[Moment]

    def stop_after(self, begun: float) -> float | None:
        """When the first word that stops came after a moment."""
        return next((at for at, word in self.commands if at >= begun and word in STOP_WORDS), None)

    def started_after(self, begun: float | None) -> bool:
        """True if a word that runs the motor came after a moment."""
        return begun is not None and any(
            at > begun and (word,) == RUN.words for at, word in self.commands
        )

    def between(self, begun: float, end: float) -> list[Moment]:
        """The moments of some time, with the one before it and the one behind it."""
        inside = [at for at, moment in enumerate(self.moments) if begun <= moment.at <= end]
        if not inside:
            inside = [sum(moment.at < begun for moment in self.moments)]
        return self.moments[max(0, inside[0] - 1) : inside[-1] + 2]

    def turns(self, at: float) -> bool:
        """True if the motor turned then."""
        return any(abs(moment.hertz) > TURNS for moment in self.between(at, at)[-1:])


class ChaosLine:
    """The line as the benchmark uses it: its LINE, and its record."""

    def __init__(self, baud: int, folder: Path) -> None:
        self._worker = Worker("from benchmarks.chaos_line import serve; serve()")
        self.text: str = self._worker.ask(baud=baud, link=str(folder / "line"))["line"]

    def record(self) -> LineRecord:
        """All that the line has seen so far."""
        reported = self._worker.ask()
        return LineRecord(
            [(at, word) for at, word in reported["commands"]],
            [Moment(*item) for item in reported["moments"]],
        )

    def plug(self, *, plugged: bool) -> None:
        """Plug the adapter in, or unplug it: its pseudo-terminal goes with it."""
        self._worker.ask(plugged=plugged)

    def close(self) -> None:
        """End the simulator."""
        self._worker.close()


class _RecordedLine(SimulatedLine):
    """Keeps each command word to drive 1."""

    commands: list[tuple[float, int]]

    def receive(self, frame: bytes, client: ClientSettings | None = None) -> PendingReply | None:
        if is_sealed(frame):
            self._note(frame[0], frame[1:-2])
        return super().receive(frame, client)

    def ask(self, unit: int, pdu: bytes) -> PendingReply | None:
        self._note(unit, pdu)
        return super().ask(unit, pdu)

    def _note(self, unit: int, pdu: bytes) -> None:
        register, data = {6: (1, 3), 16: (1, 6), 23: (5, 10)}.get(pdu[0], (0, 0))
        if unit != RUN.device or not register:
            return
        first = int.from_bytes(pdu[register : register + 2], "big")
        place = data + 2 * (COMMAND - first)
        if data <= place < len(pdu):
            self.commands.append((time.time(), int.from_bytes(pdu[place : place + 2], "big")))


def serve() -> None:
    """Serve the line of the first input line; print the record for each further line."""
    job = json.loads(sys.stdin.readline())
    timing = LineTiming(job["baud"] or 19200, "8N1", bool(job["baud"]))
    own = {1: CONSTANTS[1] | {"TTO": round(10 * TIMEOUT)}, 2: CONSTANTS[2] | {COUNTER: 0}}
    drives = [DriveSpec("atv71", device, sets=sets) for device, sets in own.items()]
    simulation = Simulation(drives, timing=timing)
    line = simulation.line = _RecordedLine(simulation.drives, timing)
    line.commands = []
    if job["baud"]:
        text = f"serial:{simulation.serve_pty(job['link'])},{job['baud']},8N1"
    else:
        text = "tcp:{}:{}".format(*simulation.serve_tcp())
    moments: list[tuple[float, float, bool, int]] = []
    threading.Thread(target=_look, args=(simulation, moments), daemon=True).start()
    answer: dict[str, Any] = {"line": text}
    print(json.dumps(answer), flush=True)
    for text in sys.stdin:
        if (plugged := json.loads(text).get("plugged")) is not None:
            (simulation.replug if plugged else simulation.unplug)()
        print(json.dumps({"commands": line.commands, "moments": moments}), flush=True)
    simulation.stop()


def _look(simulation: Simulation, moments: list[tuple[float, float, bool, int]]) -> None:
    motor, counter = simulation.drive(1), simulation.drive(2)
    for count in range(1, 30000):
        counter.set(COUNTER, count)
        moments.append((time.time(), motor.motor.frequency, motor.fault is not None, count))
        time.sleep(STEP)


_STARTING = threading.Lock()


def inside(pid: int) -> int:
    """The program that a command has started in another place, or the command itself."""
    with suppress(OSError, IndexError):
        while Path(f"/proc/{pid}/comm").read_text().strip() in OUTSIDE:
            pid = int(Path(f"/proc/{pid}/task/{pid}/children").read_text().split()[0])
    return pid


class ProgramOnTerminal:
    """A program on a pseudo-terminal of its own, which a thread empties until it is closed."""

    def __init__(
        self, arguments: Sequence[str], more: Mapping[str, str], module: str = "tui"
    ) -> None:
        with _STARTING:
            self.pid, self._terminal = start_panel([*arguments], more=more, program=(module,))
            os.set_inheritable(self._terminal, False)  # or the next program holds it open, too
        self._picture = Picture(COLUMNS, ROWS)
        self._pieces: list[bytes] = []
        self._closing, self._ended = threading.Event(), threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        threading.Thread(target=self._let_go, daemon=True).start()

    def _let_go(self) -> None:
        """Take note of its end at once, as a shell does."""
        with suppress(ChildProcessError):
            os.waitpid(self.pid, 0)
        self._ended.set()

    def _read(self) -> None:
        while not self._closing.is_set():
            if select.select([self._terminal], [], [], 0.1)[0]:
                try:
                    data = read_answering(self._terminal)
                except OSError:
                    return
                self._pieces.append(data)
                self._picture.feed(data)

    @property
    def output(self) -> str:
        """Everything written to its terminal, and the current screen."""
        return b"".join(self._pieces).decode(errors="replace") + self.picture

    @property
    def picture(self) -> str:
        """Current screen of its terminal."""
        return self._picture.text()

    def shows(self, *words: str) -> None:
        """Wait until all these words are on the terminal."""
        wait_until(lambda: all(word in self.picture for word in words), f"{words} shown")

    def press(self, key: str) -> None:
        """Type a key."""
        with suppress(OSError):  # it may have ended
            os.write(self._terminal, key.encode())

    def send(self, number: signal.Signals) -> None:
        """Send it a signal, if it lives."""
        if not self._ended.is_set():
            with suppress(ProcessLookupError):
                os.kill(inside(self.pid), number)

    def withstands(self, number: signal.Signals) -> bool:
        """True if it blocks, catches or ignores a signal, once it has started.

        A program that leads its session is never suspended by its terminal, whatever it does.
        """
        end = time.monotonic() + ENDS
        while time.monotonic() < end and not self._ended.is_set():
            with suppress(OSError):
                status = Path(f"/proc/{self.pid}/status").read_text()
                masks = re.findall(r"Sig(?:Blk|Ign|Cgt):\s*(\w+)", status)
                if any(int(mask, 16) >> (number - 1) & 1 for mask in masks):
                    return True
            time.sleep(0.05)
        return self._ended.is_set()

    def hang_up(self) -> float:
        """Close its terminal, as a window does; when that was."""
        closed = self._closing.is_set()
        self._closing.set()
        self._reader.join()
        begun = time.time()
        if not closed:
            os.close(self._terminal)
        return begun

    def ends_within(self, seconds: float) -> bool:
        """Wait for its end; False if it still lives."""
        return self._ended.wait(seconds)

    def close(self) -> None:
        """End it in any case."""
        self.send(signal.SIGKILL)
        self._ended.wait()
        self.hang_up()


class Observer:
    """`watch` of both drives, with the time at which each of its lines came."""

    def __init__(
        self, line: str, folder: Path, environment: dict[str, str], before: Sequence[str] = ()
    ) -> None:
        """`before` are the words that start a program in another place."""
        self._errors = folder / "observer"
        codes = ("RFR", "ACC", "DEC", COUNTER, "-d", "1", "-d", "2", "-p", "atv71")
        with self._errors.open("w") as errors:
            self._process = subprocess.Popen(
                [*(before or DRIVEPANEL), "watch", line, *codes, "--every", str(EVERY), "--json"],
                env=os.environ | environment,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True,
            )  # fmt: skip
        self.lines: list[tuple[float, dict[str, Any]]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for text in self._process.stdout:
            self.lines.append((time.time(), json.loads(text)))

    @property
    def output(self) -> str:
        """Its standard error."""
        return self._errors.read_text("utf-8")

    @property
    def was_killed(self) -> bool:
        """True if it did not end in order."""
        return self._process.returncode in (-signal.SIGKILL, 128 + signal.SIGKILL)

    def good(self) -> list[float]:
        """When it had good values of drive 2, which never trips."""
        return [at for at, row in self.lines if row.get("device") == 2 and _is_good(row)]

    def close(self) -> None:
        """End it."""
        with suppress(ProcessLookupError):
            os.kill(inside(self._process.pid), signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(ENDS)
        self._process.kill()
        self._process.wait()
        self._reader.join()


def wrong_values(observer: Observer, record: LineRecord) -> list[str]:
    """The values that were published as good and were not the drive's, or were old."""
    found = []
    for come, line in list(observer.lines):
        if come > record.moments[-1].at - STEP:
            break  # newer than the record
        for code, reported in (line.get("values") or {}).items():
            if reported["quality"] != "good":
                continue
            device, raw, at = line["device"], reported["raw"], _seconds(reported["time"])
            truth = record.between(at - FRESH, at + 0.1)
            low = high = CONSTANTS[device].get(code, 0)
            if code == COUNTER and device == 2:
                low, high = truth[0].count, truth[-1].count
            elif code == "RFR" and device == 1:
                low = round(10 * min(moment.hertz for moment in truth)) - 2
                high = round(10 * max(moment.hertz for moment in truth)) + 2
            elif code == COUNTER:
                continue
            if not low <= raw <= high:
                found.append(f"{code} of {device} was {low} to {high}, not {raw}")
            if _seconds(line["time"]) - at > LONGEST_CYCLE:
                found.append(f"{code} of {device} was old")
    return found


def _is_good(line: dict[str, Any]) -> bool:
    values = (line.get("values") or {}).values()
    return line["error"] is None and all(value["quality"] == "good" for value in values)


def _seconds(text: str) -> float:
    return datetime.fromisoformat(text).timestamp()


def processes_of(folder: Path) -> list[int]:
    """Programs and keepers of the round that has this folder."""
    wanted, found = f"{ROUND_SETTING}={folder}".encode(), []
    for place in Path("/proc").glob("[0-9]*/environ"):
        try:
            if wanted in place.read_bytes().split(b"\0") and is_running(int(place.parts[2])):
                found.append(int(place.parts[2]))
        except OSError:
            continue
    return found


class Stage:
    """The line of one round and the programs on it, with a state folder of their own."""

    def __init__(self, baud: int) -> None:
        self._open = ExitStack()
        self.folder = Path(self._open.enter_context(tempfile.TemporaryDirectory(prefix="chaos")))
        self.state = self.folder / "state"
        self.programs: list[ProgramOnTerminal] = []
        self.observer: Observer | None = None
        self.environment = {
            ROUND_SETTING: str(self.folder),
            "DRIVEPANEL_STATE": str(self.state),
            "DRIVEPANEL_CONFIG": str(self.folder / "config"),
            "XDG_RUNTIME_DIR": str(self.folder),
            "BROKEN_PANEL": str(self.folder / "fails"),
        }
        self.line = self._open.enter_context(closing(ChaosLine(baud, self.folder)))

    def observe(self, *before: str) -> None:
        """Start the observer; returns once it has values."""
        observer = Observer(self.line.text, self.folder, self.environment, before)
        self.observer = self._open.enter_context(closing(observer))
        try:
            wait_until(lambda: len(observer.good()) > 1, "the observer has values")
        except AssertionError as error:
            raise AssertionError(f"{error}: {observer.output}{observer.lines[-1:]}") from None

    def start(self, *arguments: str, module: str = "tui") -> ProgramOnTerminal:
        """Start a program; the LINE takes the place of `LINE`."""
        words = [self.line.text if argument == "LINE" else argument for argument in arguments]
        program = ProgramOnTerminal(words, self.environment, module)
        self.programs.append(self._open.enter_context(closing(program)))
        return program

    def start_motor(self, name: str, *extra: str, module: str) -> ProgramOnTerminal:
        """Start `run` or a panel; returns once its motor was ordered to run."""
        if name == "run":
            order = ("-d", "1", "-p", "atv71", "--reference", "20Hz", "--arm")
            program = self.start("run", "LINE", *order, *extra)
        else:
            program = self.start("LINE", "-d", "1", module=module)
            program.shows("STANDBY")
            program.press("a")
            wait_until(lambda: "ARMED" in program.picture.replace("NOT ARMED", ""), "armed")
            program.press("r")
            program.shows("RUN FORWARD at")
            for key in ("2", "0", "\r"):
                time.sleep(LINE_SETTLED)
                program.press(key)
        wait_until(lambda: self.line.record().started_after(0.0), "the motor runs")
        return program

    def output(self) -> str:
        """Output of all programs, with the log and the journal."""
        texts = [program.output for program in self.programs]
        texts += [path.read_text("utf-8") for path in self.state.glob("*.[lj]*") if path.is_file()]
        return "\n".join(texts) + (self.observer.output if self.observer else "")

    def send(self, pid: int, number: signal.Signals) -> None:
        """Send a keeper a signal, if it still lives."""
        if pid in processes_of(self.folder):
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    def end_programs(self) -> bool:
        """End all of them; False if one did not end."""
        for program in self.programs:
            program.send(signal.SIGCONT)
            program.send(signal.SIGTERM)
        if self.observer:
            self.observer.close()
        late = [terminal for terminal in self.programs if not terminal.ends_within(ENDS)]
        return not late and not (self.observer and self.observer.was_killed)

    def left(self) -> int:
        """Count the processes left after 15 s; they are killed."""
        end = time.monotonic() + LEFT
        while (found := processes_of(self.folder)) and time.monotonic() < end:
            time.sleep(0.2)
        for pid in found:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return len(found)

    def fail_drawing(self, method: str) -> float:
        """Have the next drawing of the broken panel fail; when it did."""
        switch = self.folder / "fails"
        new, raised = switch.with_suffix(".new"), switch.with_suffix(".raised")
        new.write_text(method, "utf-8")
        new.rename(switch)
        wait_until(lambda: raised.exists() and raised.read_text("utf-8") != "", "the error")
        return time.time() - time.monotonic() + float(raised.read_text("utf-8"))

    def close(self) -> None:
        """End whatever is there yet, and remove the folder."""
        self._open.close()
