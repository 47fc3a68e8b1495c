"""Verdicts of `drivepanel why` on faulty lines: correct or not, and their cost on the line.

    python -m benchmarks.doctor [--only NAME] [--seed N ...]

Twenty troubles and two healthy lines. Each is a simulated Altivar 71 behind a trouble of
`drivepanel simulate --line-fault`; a person would find it by hours of work. For each, the verdict
of `why LINE --json` is compared with the trouble. A wrong one that `why` calls certain or likely
counts as confidently wrong; so does one without any word of its certainty. What reaches the line is
recorded there: frames, and among them writes, of which there must be none.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from tests.programs import DRIVEPANEL
from tui.simulator import ClientSettings, DriveSpec, Simulation, troubles_of
from tui.simulator.server.conversation import Conversation, TcpConversation
from tui.simulator.server.endpoints import TcpEndpoint
from tui.simulator.server.frames import is_sealed

DEVICE = 2
READS = frozenset({1, 2, 3, 4, 7, 8, 11, 12, 17, 43})
"""Functions that change nothing in a drive."""
UNSURE = "possible"
"""The certainty of a verdict that names no cause as likely."""


@dataclass(frozen=True, slots=True)
class Case:
    """One trouble: what is wrong, how the line is reached, and the verdicts that name it."""

    name: str
    verdicts: frozenset[str]
    troubles: Mapping[str, float] = field(default_factory=dict)
    scheme: str = "serial"
    """Scheme by which `why` opens the line."""
    served: str = ""
    """Settings of the line, if they differ from those typed."""
    settings: str = ",19200,8E1"
    device: int = DEVICE


def _case(name: str, verdicts: str, **more: Any) -> Case:
    troubles = {kind.replace("_", "-"): value for kind, value in more.pop("line", {}).items()}
    return Case(name, frozenset(verdicts.split()), troubles, **more)


CASES = (
    _case("no drive at the address", "silence", device=9),
    _case("another baud rate", "wrong-settings silence", settings=",9600,8E1"),
    _case("one reply in ten lost", "lost", line={"lost": 0.1}),
    _case("each second request lost", "lost", line={"lost_every": 2}),
    _case("one reply in five damaged", "checksum", line={"corrupted": 0.2}),
    _case("one reply in seven cut short", "checksum", line={"truncated": 0.15}),
    _case("noise before one reply in five", "checksum noise", line={"noise": 0.2}),
    _case("all replies too late", "late", line={"late": 1}),
    _case("one reply in five twice", "duplicated", line={"duplicated": 0.2}),
    _case("replies of another address", "other-address", line={"foreign": 1}),
    _case("two drives at the address", "two-drives", line={"twin": 1}),
    _case("replies one behind", "behind", line={"behind": 1}, scheme="rtu-tcp"),
    _case("bytes swapped", "swapped", line={"swapped": 1}, scheme="tcp"),
    _case("another master polls", "other-master", line={"master": 0.2}),
    _case("gateway speaks RTU only", "wrong-protocol", scheme="tcp", served="rtu-tcp"),
    _case("gateway answers unit 255 only", "other-unit", line={"only_unit": 255}, scheme="tcp"),
    _case("gateway answers unit 0 only", "other-unit", line={"only_unit": 0}, scheme="tcp"),
    _case("gateway replies 0A", "gateway", line={"exception_0a": 1}, scheme="tcp"),
    _case("gateway replies 0B", "gateway", line={"exception_0b": 1}, scheme="tcp"),
    _case("gateway closes after 2 s idle", "idle-close", line={"idle_close": 2}, scheme="tcp"),
)
WELL = (
    _case("well, serial", "answers"),
    _case("well, Modbus TCP", "answers", scheme="tcp"),
)


class Recorded:
    """A conversation of the simulator; the functions of the requests that came."""

    def __init__(self, conversation: Conversation, functions: list[int], place: int) -> None:
        self._conversation = conversation
        self._functions = functions
        self._place = place

    def feed(self, data: bytes, now: float) -> None:
        """Take bytes that have just come in."""
        # a frame of the other protocol is not a request there
        whole = is_sealed(data) if self._place == 1 else data[2:4] == bytes(2)
        if len(data) > self._place and whole:
            self._functions.append(data[self._place])
        self._conversation.feed(data, now)

    def poll(self, now: float) -> bytes:
        """The bytes that are due to be written by now."""
        return self._conversation.poll(now)

    @property
    def due(self) -> float | None:
        """When `poll` has to be called next."""
        return self._conversation.due

    @property
    def broken(self) -> bool:
        """True once the client sent what the gateway does not understand."""
        return getattr(self._conversation, "broken", False)


class RecordedLine(Simulation):
    """A simulation that records what reaches it."""

    functions: list[int]

    def _rtu(self, client: Callable[[], ClientSettings] | None) -> Conversation:
        return Recorded(super()._rtu(client), self.functions, 1)

    def serve_tcp(self, host: str = "127.0.0.1", port: int = 0) -> tuple[str, int]:
        """Serve the drives over Modbus TCP; returns host and port."""

        def converse() -> Conversation:
            return Recorded(TcpConversation(self.line, self.faults), self.functions, 7)

        endpoint = TcpEndpoint(converse, host, port, self.faults.habits.idle_close)
        self._add(endpoint)
        return endpoint.address


@dataclass(frozen=True, slots=True)
class Result:
    """Verdict of `why` on one line, and its cost."""

    case: Case
    verdict: str
    certainty: str
    status: int
    seconds: float
    frames: int
    writes: int

    @property
    def right(self) -> bool:
        """True if the verdict names the trouble, and the status agrees."""
        return self.verdict in self.case.verdicts and self.status == (
            0 if self.verdict == "answers" else 3
        )

    @property
    def confidently_wrong(self) -> bool:
        """True if it is wrong and does not say that it is not sure."""
        return not self.right and self.certainty != UNSURE


def examine(case: Case, folder: Path, seed: int) -> Result:
    """Have one line diagnosed by a process, as a person at a shell would."""
    rates, habits = troubles_of(case.troubles)
    drive = DriveSpec("atv71", DEVICE, sets={"RFR": 425})
    simulation = RecordedLine([drive], faults=rates, habits=habits, seed=seed)
    simulation.functions = []
    with simulation:
        served = case.served or case.scheme
        if served == "serial":
            path = simulation.serve_pty(str(folder / "line"))
            line = f"serial:{path}{case.settings}"
        else:
            serve = simulation.serve_tcp if served == "tcp" else simulation.serve_rtu_tcp
            host, port = serve()
            line = f"{case.scheme}:{host}:{port}"
        began = time.monotonic()
        done = subprocess.run(
            [*DRIVEPANEL, "why", line, "-d", str(case.device), "--json"],
            env=os.environ | {"DRIVEPANEL_STATE": str(folder / "state")},
            capture_output=True, text=True, timeout=170, check=False,
        )  # fmt: skip
        seconds = time.monotonic() - began
        functions = list(simulation.functions)
    reported = json.loads(done.stdout) if done.stdout else {}
    return Result(
        case,
        reported.get("rung", f"status {done.returncode}"),
        reported.get("certainty", ""),
        done.returncode,
        seconds,
        len(functions),
        sum(function not in READS for function in functions),
    )


def table_of(results: list[Result]) -> Table:
    """The results as a table."""
    table = Table("trouble", "verdict", "certainty", "right", "s", "frames", "writes")
    for result in results:
        table.add_row(
            result.case.name, result.verdict, result.certainty or "-",
            "yes" if result.right else "NO", f"{result.seconds:.1f}", str(result.frames),
            str(result.writes),
        )  # fmt: skip
    return table


def main() -> None:
    """Examine all lines with each seed, print the tables and the figures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", default="", help="only troubles with this in their name")
    parser.add_argument("--seed", type=int, nargs="+", default=[5, 6, 7], help="one run for each")
    options = parser.parse_args()
    for seed in options.seed:
        print(json.dumps({"seed": seed, **run(options.only, seed)}))


def run(only: str, seed: int) -> dict[str, Any]:
    """Examine all lines once and print the table; returns the figures."""
    results = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for case in (*CASES, *WELL):
            if only in case.name:
                results.append(examine(case, Path(folder), seed))
                print(".", end="", file=sys.stderr, flush=True)
    Console(width=120).print(table_of(results))
    sick = [result for result in results if result.case in CASES]
    return {
        "troubles": len(sick),
        "right": sum(result.right for result in sick),
        "false_alarms": sum(not result.right for result in results if result.case in WELL),
        "confidently_wrong": sum(result.confidently_wrong for result in results),
        "seconds": round(max((result.seconds for result in results), default=0.0), 1),
        "frames": max((result.frames for result in results), default=0),
        "writes": sum(result.writes for result in results),
        "verdicts": {result.case.name: result.verdict for result in results},
    }


if __name__ == "__main__":
    main()
