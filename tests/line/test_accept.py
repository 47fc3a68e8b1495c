"""Acceptance tests on a terminal of their own: confirmed once, and at rest at every end."""

from __future__ import annotations

import json
import os
import pty
import select
import shlex
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from tests.programs import DRIVEPANEL, drivepanel, end_keepers, rtu_tcp, wait_until
from tests.sources import ROOT
from tests.sweeps import kept
from tui.simulator import DriveSpec, Simulation

from .pty_panel import WriteLog
from .test_commands import stands, turns
from .test_shared_programs import on_record, stopped_by_commands

LONG = 170.0
"""Seconds within which a whole test ends."""
SETS = {"ttO": 20, "ACC": 30, "dEC": 30}
"""Settings of the drives here: timeout 2 s, ramps of 3 s."""
RUN = '\n[[steps]]\nkind = "direction"\nhz = 30\nseconds = 60\n'
STEPS = {
    "direction": 'kind = "direction"\nhz = 5\nseconds = 0.5',
    "ramp": 'kind = "ramp"\nhz = 50\nup = 3.0\ndown = 3.0',
    "limit": 'kind = "limit"\nseconds = 1',
    "loss": 'kind = "communication-loss"\ntimeout = 2.0',
    "loss turning": 'kind = "communication-loss"\ntimeout = 2.0\nturning = true\nhz = 20',
    "stop": 'kind = "stop"\nmethod = "quick-stop"\nhz = 40\nseconds = 0.2\nmax = 1.0',
    "reset": 'kind = "reset"',
}


@dataclass
class Acceptance:
    """`drivepanel accept` on a pseudo-terminal."""

    pid: int
    terminal: int
    folder: Path
    text: str = ""
    status: int | None = None
    _closed: bool = field(default=False)

    def look(self) -> bool:
        """Read its output; return False once it has ended."""
        while select.select([self.terminal], [], [], 0.05)[0]:
            try:
                data = os.read(self.terminal, 4096)
            except OSError:
                return False
            if not data:
                return False
            self.text += data.decode(errors="replace")
        return True

    def type(self, text: str) -> None:
        """Type on its terminal."""
        os.write(self.terminal, text.encode())

    def wait_for(self, *words: str) -> None:
        """Wait until all the words were printed."""

        def there() -> bool:
            alive = self.look()
            found = all(word in self.text for word in words)
            assert alive or found, self.text
            return found

        wait_until(there, f"{words}: {self.text}", LONG)

    def answer(self, text: str = "y") -> None:
        """Answer its question."""
        self.wait_for("[y/N]")
        time.sleep(0.2)  # what was typed before the question does not count
        self.type(f"{text}\n")

    def end(self) -> int:
        """Wait for its end; return its exit status."""
        if self.status is None:
            wait_until(lambda: not self.look(), f"it ends: {self.text}", LONG)
            self.status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        return self.status

    def hang_up(self) -> None:
        """Close its terminal."""
        self._closed = True
        os.close(self.terminal)

    def close(self) -> None:
        """Kill it, if it has not ended."""
        if self.status is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)
            with suppress(ChildProcessError):
                os.waitpid(self.pid, 0)
        if not self._closed:
            os.close(self.terminal)

    @property
    def result(self) -> dict[str, Any]:
        """Its JSON file."""
        (path,) = self.folder.glob("*.json")
        found: dict[str, Any] = json.loads(path.read_text("utf-8"))
        return found


@contextmanager
def accepting(file: Path, line: str, *options: str, shell: str = "") -> Iterator[Acceptance]:
    """Start a test of the drive at address 1; `shell` runs it by a line of a shell."""
    folder = file.parent / "out"
    words = [*DRIVEPANEL, "accept", str(file), line, "--arm", "--out", str(folder), *options]
    if shell:
        words = ["bash", "-mc", shell.format(shlex.join(words))]
    pid, terminal = pty.fork()
    if pid == 0:
        os.execvp(words[0], words)
    program = Acceptance(pid, terminal, folder)
    try:
        yield program
    finally:
        program.close()
        end_keepers()


def written(folder: Path, *steps: str, profile: str = "atv312") -> Path:
    """A test file with these steps."""
    path = folder / "t.toml"
    head = f'format = 1\nname = "T"\nprofile = "{profile}"\n'
    path.write_text(head + "".join(f"\n[[steps]]\n{step}\n" for step in steps), "utf-8")
    return path


@contextmanager
def drive(**more: Any) -> Iterator[tuple[Simulation, str]]:
    """A simulated drive, and the LINE to it."""
    with Simulation([DriveSpec(**{"profile": "atv312", "sets": SETS, **more})]) as simulation:
        yield simulation, rtu_tcp(simulation)


@contextmanager
def motor_of_a_test(folder: Path) -> Iterator[tuple[Simulation, str, Acceptance]]:
    """A confirmed test whose motor turns for a minute."""
    with (
        drive(sets={**SETS, "ttO": 100}) as (simulation, line),
        accepting(written(folder, RUN.strip().partition("\n")[2]), line) as program,
    ):
        program.answer()
        wait_until(lambda: program.look() and turns(simulation), "the motor turns")
        yield simulation, line, program


EXAMPLES: dict[str, dict[str, int]] = {
    "atv312": {"ttO": 20},
    "atv21": {"F803": 2, "ACC": 30, "dEC": 30},
    "atv31": {"ttO": 20},
    "atv71": {"TTO": 20},
    "powerdrive": {"15.07": 20, "6.43": 1},
    "proxidrive": {"15.07": 20, "6.43": 1},
    "varmeca": {"15.07": 20, "6.43": 1},
}
"""Settings of a drive that passes the example of its family."""


@pytest.mark.timeout(LONG + 30)
@pytest.mark.parametrize("profile", kept(EXAMPLES, "powerdrive"))
def test_example_of_a_family_passes(profile: str, tmp_path: Path) -> None:
    file = tmp_path / f"{profile}.toml"
    file.write_text((ROOT / "docs" / "acceptance" / file.name).read_text("utf-8"), "utf-8")
    spec = DriveSpec(profile, sets=EXAMPLES[profile])
    with Simulation([spec]) as simulation, accepting(file, rtu_tcp(simulation)) as program:
        program.answer()
        if "15.07" in EXAMPLES[profile]:
            program.wait_for("r right / l left")
            time.sleep(0.2)
            program.type("r\n")
        assert program.end() == 0, program.text
        assert stands(simulation)
        assert program.result["passed"], program.text
        assert {step["outcome"] for step in program.result["steps"]} == {"passed"}
    suite = ElementTree.parse(program.folder / f"{profile}.xml").getroot()
    assert (suite.attrib["failures"], suite.attrib["skipped"]) == ("0", "0")
    text = (program.folder / f"{profile}.md").read_text("utf-8")
    for name in (path.name for path in program.folder.glob("*.svg")):
        assert f"]({name})" in text


def unfolded(text: str) -> str:
    """Text without the line ends of a narrow terminal."""
    return " ".join(text.split())


def test_steps_on_the_run_pass(tmp_path: Path) -> None:
    steps = [STEPS[name] for name in ("ramp", "stop", "limit", "loss turning", "reset")]
    with drive() as (simulation, line), accepting(written(tmp_path, *steps), line) as program:
        program.answer()
        assert "forward at HSP = 50 Hz, then with a reference 1 Hz ABOVE" in unfolded(program.text)
        assert program.end() == 0, program.text
        assert stands(simulation)
        assert simulation.drive(1).fault is None


PLANTED = {
    "slow-ramps": ("ramp", "did not reach 50 Hz within"),
    "swapped-direction": ("direction", "reverse"),
    "no-timeout": ("loss", "DID NOT REACT"),
    "no-limits": ("limit", "Output with 51Hz: 5"),
}


@pytest.mark.parametrize("defect", PLANTED)
def test_planted_defect_fails_the_test(defect: str, tmp_path: Path) -> None:
    step, why = PLANTED[defect]
    file = written(tmp_path, STEPS[step], STEPS["direction"])
    with drive() as (simulation, line), accepting(file, line) as program:
        simulation.drive(1).conditions.planted.add(defect)
        program.answer()
        assert program.end() == 1, program.text
        first, second = program.result["steps"]
        assert (first["outcome"], second["outcome"]) == ("failed", "not run")
        assert why in first["text"]
        assert abs(simulation.drive(1).motor.frequency) < 0.1


def test_timeout_that_is_off_fails_the_test(tmp_path: Path) -> None:
    file = written(tmp_path, 'kind = "communication-loss"\ntimeout = 2.0', profile="atv21")
    with (
        drive(profile="atv21", sets={"F803": 0}) as (_, line),
        accepting(file, line) as program,
    ):
        program.answer()
        assert program.end() == 1, program.text
        assert "F803 is" in program.result["steps"][0]["text"]


@pytest.mark.parametrize(("options", "status"), [((), 1), (("--rated-current", "5"), 0)])
def test_limit_in_amperes_needs_a_current_in_amperes(
    options: tuple[str, ...], status: int, tmp_path: Path
) -> None:
    """The Altivar 21 reports a share of its rated current: 39 % are not 39 A."""
    step = 'kind = "speeds"\nhz = 20\npercent = [100]\nseconds = 0.3\n'
    step += 'limits = { motor_current = { min = 1.0, max = 5, unit = "A" } }'
    with (
        drive(profile="atv21", sets={"ACC": 10, "dEC": 10}) as (_, line),
        accepting(written(tmp_path, step, profile="atv21"), line, *options) as program,
    ):
        program.answer()
        assert program.end() == status, program.text
        checks = {c["name"]: c["value"] for c in program.result["steps"][0]["checks"]}
        value = checks["100 %: Motor current"]
        assert value.endswith(" A") if status == 0 else value == "-----"


@pytest.mark.parametrize("answer", ["n", "", "yes please"])
def test_nothing_is_written_without_a_yes(answer: str, tmp_path: Path) -> None:
    with Simulation([DriveSpec("atv312")]) as simulation:
        with WriteLog(simulation.serve_tcp()).at_work() as log:
            line = f"tcp:127.0.0.1:{log.port}"
            with accepting(written(tmp_path, STEPS["direction"]), line) as program:
                program.type("y\n")  # before the question: it does not count
                program.answer(answer)
                assert program.end() == 5, program.text
        assert log.writes == []
        assert not program.folder.exists()


def interrupt(program: Acceptance, number: signal.Signals, times: int = 1) -> None:
    """Send it a signal, several times without waiting."""
    for _ in range(times):
        os.kill(program.pid, number)


ENDINGS: dict[str, tuple[Callable[[Acceptance], None], int]] = {
    "Ctrl-C": (lambda program: program.type("\x03"), 130),
    "Enter": (lambda program: program.type("\n"), 6),
    "SIGTERM": (lambda program: interrupt(program, signal.SIGTERM), 143),
    "three SIGINT": (lambda program: interrupt(program, signal.SIGINT, 3), 130),
}


@pytest.mark.parametrize("name", ENDINGS)
def test_person_ends_the_test(name: str, tmp_path: Path) -> None:
    end, status = ENDINGS[name]
    with motor_of_a_test(tmp_path) as (simulation, _, program):
        end(program)
        assert program.end() == status, program.text
        assert stopped_by_commands(simulation)
        assert program.result["ended_by"]
        assert program.result["steps"][0]["outcome"] == "failed"
        assert on_record() == []


def test_end_of_the_test_takes_a_reference_above_the_limit_back(tmp_path: Path) -> None:
    with drive() as (simulation, line), above_the_limit(tmp_path, simulation, line) as program:
        program.type("\x03")
        assert program.end() == 130, program.text
        assert simulation.drive(1).raw("LFr") == 500, program.text
        assert stands(simulation)


def test_reference_above_the_limit_is_reported_after_a_stop_by_another_program(
    tmp_path: Path,
) -> None:
    with drive() as (simulation, line), above_the_limit(tmp_path, simulation, line) as program:
        assert drivepanel("stop", line, "-d", "1", "-p", "atv312").returncode == 0, program.text
        assert program.end() == 6, program.text
        kept = "may still hold the reference 51Hz" in program.text
        assert simulation.drive(1).raw("LFr") == (510 if kept else 500), program.text
        assert stands(simulation)


@contextmanager
def above_the_limit(folder: Path, simulation: Simulation, line: str) -> Iterator[Acceptance]:
    """A test that has just given a reference above the high speed."""
    file = written(folder, 'kind = "limit"\nseconds = 60')
    with accepting(file, line) as program:
        program.answer()
        wait_until(lambda: program.look() and simulation.drive(1).raw("LFr") == 510, "it is above")
        yield program


def test_closed_terminal_stops_the_motor(tmp_path: Path) -> None:
    with motor_of_a_test(tmp_path) as (simulation, _, program):
        program.hang_up()
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp", 15.0)
        wait_until(lambda: on_record() == [], "the record is removed")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_keeper_stops_the_motor_of_a_killed_test(number: signal.Signals, tmp_path: Path) -> None:
    with motor_of_a_test(tmp_path) as (simulation, _, program):
        assert on_record() == [False]
        os.kill(program.pid, number)
        wait_until(lambda: stopped_by_commands(simulation), "the motor stops on its ramp", 20.0)
        os.kill(program.pid, signal.SIGCONT)
        time.sleep(1.0)
        assert stands(simulation)


def test_output_that_is_no_longer_read_stops_the_motor(tmp_path: Path) -> None:
    file = written(tmp_path, RUN.strip().partition("\n")[2])
    with (
        drive(sets={**SETS, "ttO": 100}) as (simulation, line),
        accepting(file, line, shell="{} | head -1") as program,
    ):
        program.answer()
        program.end()
        assert stands(simulation)
        assert "its output is no longer read" in program.result["ended_by"]


def test_test_in_the_background_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, STEPS["direction"])
    with drive() as (_, line), accepting(file, line, shell="{} & wait $!") as program:
        assert program.end() == 5, program.text
        assert "in the background" in program.text
        assert "[y/N]" not in program.text


def test_motor_that_does_not_stop_is_reported(tmp_path: Path) -> None:
    with motor_of_a_test(tmp_path) as (simulation, _, program):
        simulation.drive(1).busy = True
        program.type("\n")
        assert program.end() == 4, program.text
        assert "NOT STOPPED" in program.text
        assert not program.result["passed"]
        simulation.drive(1).busy = False


def test_second_test_of_the_same_drive_is_refused(tmp_path: Path) -> None:
    with motor_of_a_test(tmp_path) as (simulation, line, first):
        folder = tmp_path / "more"
        folder.mkdir()
        with accepting(written(folder, STEPS["direction"]), line) as second:
            assert second.end() == 5, second.text
            assert "[y/N]" not in second.text
        assert turns(simulation)
        first.type("\n")
        assert first.end() == 6, first.text
        assert stopped_by_commands(simulation)


def test_stop_by_another_program_ends_the_test(tmp_path: Path) -> None:
    with motor_of_a_test(tmp_path) as (simulation, line, program):
        done = drivepanel("stop", line, "-d", "1", "-p", "atv312")
        assert done.returncode == 0, done.stderr
        assert program.end() == 6, program.text
        assert stopped_by_commands(simulation)
        assert "stopped by drivepanel stop" in program.result["ended_by"]


def test_stop_between_two_steps_ends_the_test(tmp_path: Path) -> None:
    file = written(
        tmp_path, 'kind = "direction"\nhz = 5\nseconds = 0.2\nturns = "left"', STEPS["ramp"]
    )
    with drive() as (simulation, line), accepting(file, line) as program:
        program.answer()
        program.wait_for("r right / l left")
        assert drivepanel("stop", line, "-d", "1", "-p", "atv312").returncode == 0
        assert program.end() == 6, program.text
        assert stands(simulation)
        assert program.result["steps"][1]["outcome"] == "not run"


@pytest.mark.parametrize(("code", "raw"), [("CMD", 6), ("LFr", 150)])
def test_another_master_ends_the_test(code: str, raw: int, tmp_path: Path) -> None:
    """It writes past every program of this computer, as a PLC on the line does."""
    with motor_of_a_test(tmp_path) as (simulation, _, program):
        there = simulation.drive(1)
        address = there.profile.find(code).address
        there.server.answer(bytes([6, *address.to_bytes(2, "big"), *raw.to_bytes(2, "big")]))
        assert program.end() == 6, program.text
        assert stands(simulation)
        assert "another" in program.result["ended_by"]


def test_lost_line_stops_the_motor_once_it_is_back(tmp_path: Path) -> None:
    with motor_of_a_test(tmp_path) as (simulation, _, program):
        simulation.unplug()
        program.wait_for("NOT STOPPED yet")
        time.sleep(0.5)
        assert turns(simulation), "its timeout is 10 s"
        simulation.replug()
        assert program.end() == 6, program.text
        assert stopped_by_commands(simulation)
        assert "lost" in program.result["ended_by"]


def test_wrong_statement_of_the_person_fails_the_test(tmp_path: Path) -> None:
    file = written(tmp_path, 'kind = "direction"\nhz = 5\nseconds = 0.2\nturns = "left"')
    with drive() as (_, line), accepting(file, line) as program:
        program.answer()
        program.wait_for("r right / l left")
        time.sleep(0.2)
        program.type("r\n")
        assert program.end() == 1, program.text
        assert "Seen by the person: right" in program.result["steps"][0]["text"]
