"""Rounds of `chaos` on a computer of a plant: a service, log-ins, other users, containers.

They are played in `plant_box`, where systemd is the first process.
"""

from __future__ import annotations

import atexit
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import asdict
from pathlib import Path

from pymodbus.client import ModbusTcpClient

from benchmarks.chaos_line import LineRecord, ProgramOnTerminal, Stage, processes_of
from benchmarks.chaos_round import FROZEN, REPORTED, Outcome, Round
from benchmarks.in_place import LEFT_ALONE, LOGGED_IN
from benchmarks.plant_box import GROUP, LINGERS, PLACE, SERVICE, USERS, NoBox, plant_box
from tests.line.pty_panel import COMMAND, REFERENCE
from tests.programs import PATIENCE, is_running, wait_until
from tests.sources import ROOT

End = tuple[float, float | None, bool]
STATUS = 3201
READ_EVERY, SETTLED = 0.5, 0.3
SHOWN_WITHIN = 3.5
"""Seconds in which NOT STOPPED is shown if no stop can be sent: a second after the keeper was
killed in vain."""
BACK_AFTER = 3.0
"""Seconds that a stop may take once a frozen keeper goes on, and dies of it."""
LOG_IN = 2.0
"""Seconds that a log-in may take."""
LEFT_EMPTY = 4.0
"""Seconds after a log-out in which the runtime folder of the user is removed."""


class Service:
    """`serve` as the unit of the repository, with what a test needs of paths and ports."""

    def __init__(self, stage: PlantStage, number: int) -> None:
        self._name = f"chaos-{number}.service"
        with socket.create_server(("127.0.0.1", 0)) as free:
            self._port = free.getsockname()[1]
        state = stage.folder / f"state-{SERVICE}"
        state.mkdir()
        subprocess.run(["chown", f"{SERVICE}:{GROUP}", str(state)], check=True)
        kept = stage.environment | {"DRIVEPANEL_STATE": str(state), "PYTHONPATH": str(ROOT)}
        kept.pop("XDG_RUNTIME_DIR", None)
        serve = f"{sys.executable} -m tui serve {stage.line.text} --share-group {GROUP}"
        own = [
            f"ExecStart={serve} --tcp 127.0.0.1:{self._port} --allow-commands -d 1 -p atv71",
            *(f"Environment={name}={value}" for name, value in kept.items()),
            f"ReadWritePaths={stage.folder}",
            "DeviceAllow=char-pts rw",
            "ProtectHome=no",
        ]
        lines = []
        for line in (ROOT / "systemd/drivepanel.service").read_text("utf-8").splitlines():
            if line.startswith("ExecStart="):
                lines += own
            elif not line.startswith(("Environment", "ProtectHome")):
                lines.append(line)
        Path("/run/systemd/system", self._name).write_text("\n".join(lines) + "\n", "utf-8")
        self.systemctl("daemon-reload")
        self.systemctl("start")

    def systemctl(self, *words: str) -> None:
        """Have systemd do something with it."""
        name = [] if words == ("daemon-reload",) else [self._name]
        done = subprocess.run(["systemctl", *words, *name], capture_output=True, text=True)
        assert not done.returncode, f"systemctl {words}: {done.stderr}"

    def run_motor(self) -> None:
        """Run the motor of drive 1 by Modbus TCP, and keep reading it as a controller does."""
        self._client = ModbusTcpClient("127.0.0.1", port=self._port, timeout=PATIENCE, retries=0)
        assert self._client.connect()  # type: ignore[no-untyped-call]
        for address, word in ((COMMAND, 6), (COMMAND, 7), (REFERENCE, 200), (COMMAND, 15)):
            answer = self._client.write_register(address, word, device_id=1)
            assert not answer.isError(), str(answer)
            time.sleep(SETTLED)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with suppress(Exception):
            while True:
                self._client.read_holding_registers(STATUS, count=1, device_id=1)
                time.sleep(READ_EVERY)

    def send(self, number: signal.Signals) -> None:
        """End it as systemd does, or send all its processes a signal."""
        words = ("stop", "--no-block") if number == signal.SIGTERM else ("kill", "-s", number.name)
        with suppress(AssertionError):
            self.systemctl(*words)

    def ends_within(self, seconds: float) -> bool:
        """Wait for its end; False if it still lives."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            done = subprocess.run(["systemctl", "is-active", self._name], capture_output=True)
            if done.stdout.strip() in (b"inactive", b"failed"):
                return True
            time.sleep(0.1)
        return False


class PolledDrive:
    """A program whose log-in has ended without it."""

    def __init__(self, pid: int) -> None:
        self._pid = pid

    def send(self, number: signal.Signals) -> None:
        """Send it a signal, if it lives."""
        with suppress(ProcessLookupError):
            os.kill(self._pid, number)

    def ends_within(self, seconds: float) -> bool:
        """Wait for its end; False if it still lives."""
        with suppress(AssertionError):
            wait_until(lambda: not is_running(self._pid), "it ends", seconds)
        return not is_running(self._pid)


class PlantStage(Stage):
    """A line on which programs of several users meet, in a folder that all may enter."""

    def __init__(self, baud: int) -> None:
        super().__init__(baud)
        self.folder.chmod(0o755)
        if baud:
            (self.folder / "line").resolve().chmod(0o666)
        self.services: list[Service] = []
        self.group = self.folder / "group"
        command = ["install", "-d", "-m", "2770", "-g", GROUP, str(self.group)]
        subprocess.run(command, check=True)

    def share(self) -> None:
        """Let the programs of all users of the group meet."""
        own = {"DRIVEPANEL_SHARE_GROUP": GROUP, "DRIVEPANEL_SHARE_FOLDER": str(self.group)}
        self.environment |= own

    def start_in(self, *arguments: str) -> ProgramOnTerminal:
        """Start a program in another place: place, user, and its own arguments."""
        return self.start(*arguments, module="benchmarks.in_place")

    def start_keeper(self, *place: str) -> None:
        """Have a command start the keeper, here or in another place."""
        words = ("read", "LINE", "RFR", "-d", "1", "-p", "atv71")
        starter = self.start_in(*place, *words) if place else self.start(*words)
        assert starter.ends_within(PATIENCE), "read does not end"

    def run_motor_in(self, place: str, user: str) -> ProgramOnTerminal:
        """Start `run` in another place; returns once its motor was ordered to run."""
        order = ("-d", "1", "-p", "atv71", "--reference", "20Hz", "--arm")
        program = self.start_in(place, user, "run", "LINE", *order)
        wait_until(lambda: self.line.record().started_after(0.0), "the motor runs")
        return program

    def observe_in(self, place: str, user: str) -> None:
        """Start the observer in another place."""
        before = [sys.executable, "-m", "benchmarks.in_place", place, user]
        self.observe(*before)

    def serve(self, number: int) -> Service:
        """Start `serve` as a service."""
        self.services.append(Service(self, number))
        return self.services[-1]

    def keeper(self) -> int | None:
        """The process id of the keeper that lives; None if there is none."""
        for pid in processes_of(self.folder):
            with suppress(OSError):
                if b"tui.keeper" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                    return pid
        return None

    def output(self) -> str:
        """Output of all programs, with the logs and journals of all users."""
        logs = [path.read_text("utf-8", "replace") for path in self.folder.glob("state-*/*.[lj]*")]
        return "\n".join([super().output(), *logs])

    def end_programs(self) -> bool:
        """End all of them; False if one did not end."""
        (self.folder / LOGGED_IN).unlink(missing_ok=True)
        for service in self.services:
            service.send(signal.SIGTERM)
        return all(item.ends_within(40.0) for item in self.services) & super().end_programs()


_box_lock = threading.Lock()
_box: list[list[str] | str] = []


def entered() -> list[str]:
    """The words before a command that run it in the box of this benchmark. Raises NoBox."""
    with _box_lock:
        if not _box:
            stack = ExitStack()
            atexit.register(stack.close)
            try:
                _box.append(stack.enter_context(plant_box()))
            except NoBox as error:
                _box.append(str(error))
        found = _box[0]
    if isinstance(found, str):
        raise NoBox(found)
    return found


class _InBox(Round):
    """A round that is played in the box."""

    stage_of = PlantStage
    _stage: PlantStage

    def play(self) -> None:
        """Have it played there."""
        outcome = self._outcome
        try:
            enter = entered()
        except NoBox as error:
            outcome.failed = str(error)
            return
        job = [asdict(outcome), self._chance.random(), self._after, self._slack]
        command = [*enter, "env", f"TMPDIR={PLACE}", f"PYTHONPATH={ROOT}", f"--chdir={ROOT}",
                   sys.executable, "-m", "benchmarks.chaos_plant"]  # fmt: skip
        done = subprocess.run(command, input=json.dumps(job), capture_output=True, text=True)
        if done.returncode:
            outcome.failed = done.stderr[-500:]
            return
        for name, value in json.loads(done.stdout.splitlines()[-1]).items():
            setattr(outcome, name, value)

    def play_here(self) -> None:
        """Play it, and judge it."""
        super().play()

    @property
    def _user(self) -> str:
        return f"user{self._outcome.number % USERS}"


class UnitEnds(_InBox):
    """The unit of `serve` ends, which has started the keeper."""

    def _begin(self) -> None:
        self._stage.share()
        self._service = self._stage.serve(self._outcome.number)
        self._beside = "beside" in self._end
        if self._beside:
            self._owner = self._stage.run_motor_in("session", self._user)
        else:
            self._service.run_motor()
        self._ready = time.time()
        self._stage.observe()

    def _end_victim(self) -> End:
        begun = time.time()
        killed = "kill -9" in self._end
        if killed:
            self._service.send(signal.SIGKILL)
        else:
            self._service.systemctl("stop", "--no-block")
        if self._beside:
            return begun, None, True
        return begun, FROZEN if killed else 0.0, False


class SessionEnds(_InBox):
    """The session ends that has started the keeper, and systemd kills what is left of it."""

    def _begin(self) -> None:
        stage = self._stage
        stage.share()
        self._beside = "beside" in self._end
        if self._beside:
            stage.start_in("session", self._user, "watch", "LINE", "RFR", "-d", "2", "-p", "atv71")
            wait_until(lambda: stage.keeper() is not None, "its keeper")
            self._owner = stage.serve(self._outcome.number)
            self._owner.run_motor()
        else:
            self._owner = stage.run_motor_in("session", self._user)
        self._ready = time.time()
        stage.observe()

    def _end_victim(self) -> End:
        begun = time.time()
        subprocess.run(["loginctl", "terminate-user", self._user], check=True)
        return begun, None if self._beside else 0.0, self._beside


class LoggedOut(_InBox):
    """A program outlives its log-in, whose runtime folder is removed; a later one stops it."""

    def _begin(self) -> None:
        stage = self._stage
        stage.run_motor_in("logout", LINGERS)
        pid = int((stage.folder / f"state-{LINGERS}" / LEFT_ALONE).read_text())
        self._owner = PolledDrive(pid)
        self._ready = time.time()
        stage.observe_in("user", LINGERS)

    def _end_victim(self) -> End:
        (self._stage.folder / LOGGED_IN).unlink()
        time.sleep(LEFT_EMPTY)
        begun = time.time()
        self._stage.start_in("session", LINGERS, "stop", "LINE", "-d", "1", "-p", "atv71")
        return begun, LOG_IN, False


class ForeignKeeper(_InBox):
    """The keeper is another user's, or in another PID namespace; `run` cannot kill it."""

    _frozen = 0.0

    def _begin(self) -> None:
        stage = self._stage
        place = "namespace" if "namespace" in self._end else "user"
        first = f"user{(self._outcome.number + 1) % USERS}"
        if place == "user":
            stage.share()
            stage.start_keeper(place, first)
        else:
            stage.start_keeper()
        self._owner = self._victim = stage.run_motor_in(place, self._user)
        self._ready = time.time()
        stage.observe_in(place, self._user)

    def _end_victim(self) -> End:
        begun, keeper = time.time(), self._stage.keeper()
        assert keeper is not None, "the keeper is not there"
        if "kill -9" in self._end:
            os.kill(keeper, signal.SIGKILL)
            return begun, None, True
        self._frozen = begun
        os.kill(keeper, signal.SIGSTOP)
        time.sleep(self._chance.uniform(0.0, 2.5))
        begun = time.time()
        self._owner.send(signal.SIGINT)
        time.sleep(SHOWN_WITHIN)
        if self._stage.line.record().stop_after(begun) is None and not REPORTED.search(
            self._victim.output
        ):
            self._outcome.broken.append(f"not shown in {SHOWN_WITHIN} s: no stop can be sent")
        time.sleep(self._chance.uniform(0.0, 4.0))
        with suppress(ProcessLookupError):
            os.kill(keeper, signal.SIGCONT)
        return begun, time.time() - begun + BACK_AFTER, False

    def _judge_values(self, record: LineRecord, begun: float) -> None:
        super()._judge_values(record, self._frozen or begun)


class KilledInNamespace(_InBox):
    """`run`, or the keeper with all else, is killed in a PID namespace of its own."""

    def _begin(self) -> None:
        stage = self._stage
        if self._outcome.program == "run":
            stage.start_keeper()
            self._owner = self._victim = stage.run_motor_in("namespace", "root")
            self._ready = time.time()
            stage.observe_in("namespace", "root")  # both have process id 1
            return
        watch = ("watch", "LINE", "RFR", "-d", "2", "-p", "atv71")
        self._victim = stage.start_in("namespace", "root", *watch)
        wait_until(lambda: stage.keeper() is not None, "its keeper")
        self._owner = stage.start_motor("run", module="tui")
        self._ready = time.time()
        stage.observe()

    def _end_victim(self) -> End:
        begun = time.time()
        self._victim.send(signal.SIGKILL)
        if self._outcome.program == "run":
            return begun, 0.0, False
        return begun, None, True


PLANT_ROUNDS: dict[tuple[str, str], type[_InBox]] = {
    ("unit", "systemctl stop, with its motor"): UnitEnds,
    ("unit", "systemctl stop beside run"): UnitEnds,
    ("unit", "kill -9, with its motor"): UnitEnds,
    ("unit", "kill -9 beside run"): UnitEnds,
    ("session", "KillUserProcesses, with its motor"): SessionEnds,
    ("session", "KillUserProcesses beside serve"): SessionEnds,
    ("session", "log-out, then stop"): LoggedOut,
    ("keeper", "kill -9, of another user"): ForeignKeeper,
    ("keeper", "SIGSTOP, of another user"): ForeignKeeper,
    ("keeper", "kill -9, PID namespace"): ForeignKeeper,
    ("keeper", "SIGSTOP, PID namespace"): ForeignKeeper,
    ("run", "kill -9, PID namespace"): KilledInNamespace,
    ("watch", "kill -9 with its keeper, PID namespace"): KilledInNamespace,
}
"""Program and end, and what plays it."""


def main() -> None:
    """Play the round that standard input describes, in the box."""
    fields, seed, after, slack = json.loads(sys.stdin.read())
    outcome = Outcome(**fields)
    kind = PLANT_ROUNDS[outcome.program, outcome.end]
    kind(outcome, random.Random(seed), after, slack).play_here()
    print(json.dumps(asdict(outcome)))


if __name__ == "__main__":
    main()
