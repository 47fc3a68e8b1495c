"""Drives of two other makes by a file alone, at a libmodbus server with unusual behavior.

It answers after 30 ms, reads 8 words at most and none over a hole, is silent at function 43, and
puts the high word first. Both files are in `profiles`. They are examples that no real drive
confirms.
"""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.programs import Served, drivepanel, pty_pair, served, wait_until
from tests.sweeps import kept
from tui.drive.profile import library

from .conftest import HERE

DEVICE = 3


@dataclass(frozen=True)
class Kind:
    """A kind of drive and its names."""

    profile: str
    chart: str
    frequency: str
    ramp: str
    fault: str
    saves: bool


KINDS = (
    Kind("atv320-kind", "drivecom", "RFR", "ACC", "OCF", saves=True),
    Kind("ms300-kind", "bits", "FREQOUT", "01-12", "ocA", saves=False),
)


@dataclass(frozen=True)
class Bench:
    """A drive of a kind on a line without settings."""

    kind: Kind
    line: str
    server: Served

    def run(self, command: str, *more: str) -> subprocess.CompletedProcess[str]:
        """A command of the panel with this drive."""
        there = ["-d", str(DEVICE), "-p", self.kind.profile]
        return drivepanel(command, self.line, *more, *there)

    def done(self, command: str, *more: str) -> str:
        """Output of a command that ends."""
        done = self.run(command, *more)
        assert done.returncode == 0, done.stderr + done.stdout
        return done.stdout

    def status(self) -> dict[str, object]:
        """State of the drive."""
        reported: dict[str, object] = json.loads(self.done("status", "--json"))
        return reported

    def values(self, *codes: str) -> dict[str, object]:
        """Values as they are read now."""
        reported = json.loads(self.done("read", *codes, "--json"))
        return {code: item["value"] for code, item in reported["values"].items()}


@pytest.fixture(params=kept(KINDS, KINDS[1]), ids=lambda kind: kind.profile)
def bench(request: pytest.FixtureRequest, awkward_drive: Path) -> Iterator[Bench]:
    kind: Kind = request.param
    folder = library.user_folder()
    folder.mkdir(parents=True)
    shutil.copy(HERE / "profiles" / f"{kind.profile}.toml", folder)
    with pty_pair() as (near, far):
        command = [str(awkward_drive), kind.chart, far, str(DEVICE)]
        with served(command, ready="ready") as server:
            yield Bench(kind, f"serial:{near}", server)


def test_own_profiles_are_valid() -> None:
    for kind in KINDS:
        assert library.faults_of(HERE / "profiles" / f"{kind.profile}.toml") == []


def test_own_drive_is_found_and_monitored(bench: Bench) -> None:
    refused = drivepanel("status", f"{bench.line},9600,8N1", "-d", "3")
    assert refused.returncode == 2
    assert f"name its profile with -p: {bench.kind.profile}" in refused.stderr
    rows = bench.done("watch", "--count", "2", "--every", "0.2", "--json").splitlines()
    last = json.loads(rows[-1])
    assert {item["quality"] for item in last["values"].values()} == {"good"}
    assert bench.values("HOURS") == {"HOURS": 70000}
    fields = json.loads(bench.done("read", "FANMODE", "DIMMING", "--json"))["values"]
    assert {code: item["raw"] for code, item in fields.items()} == {"FANMODE": 1, "DIMMING": 2}
    if bench.kind.chart == "bits":
        assert bench.values("TEMP") == {"TEMP": 41.7}


def test_own_drive_runs_trips_and_is_reset(bench: Bench) -> None:
    for more, way in (([], "forward"), (["--reverse"], "reverse")):
        wish = ["--arm", "--reference", "25Hz", "--for", "0.5", "--leave-running", *more]
        bench.done("run", *wish)
        reported = bench.status()
        assert (kind_of(reported), reported["direction"]) == ("running", way)
        turned = bench.values(bench.kind.frequency)[bench.kind.frequency]
        assert turned in (25.0, -25.0)
        bench.done("stop")
        assert kind_of(bench.status()) not in ("running", "stopping")
        assert bench.values(bench.kind.frequency) == {bench.kind.frequency: 0.0}
    bench.server.process.send_signal(signal.SIGUSR1)
    wait_until(lambda: kind_of(bench.status()) == "fault", "it trips")
    fault = bench.status()["fault"]
    assert isinstance(fault, dict)
    assert fault["code"] == bench.kind.fault
    refused = bench.run("run", "--arm", "--for", "1", "--reference", "25Hz")
    assert refused.returncode in (4, 5), refused.stdout
    bench.done("reset", "--arm")
    assert kind_of(bench.status()) not in ("fault", "running")
    bench.done("stop")


def kind_of(status: dict[str, object]) -> object:
    """The kind of the drive's state."""
    state = status["state"]
    assert isinstance(state, dict)
    return state["kind"]


def test_own_drive_is_configured_backed_up_and_restored(bench: Bench, tmp_path: Path) -> None:
    kept = tmp_path / "set.toml"
    bench.done("backup", str(kept))
    ramp = bench.kind.ramp
    before = bench.values(ramp)
    bench.done("write", f"{ramp}=7.5s", "FANMODE=Automatic", "DIMMING=High", "--arm")
    assert bench.values(ramp, "FANMODE", "DIMMING") == {ramp: 7.5, "FANMODE": 2, "DIMMING": 3}
    past = bench.run("write", f"{ramp}=100000s", "--arm")
    assert past.returncode != 0
    save = ["--save"] if bench.kind.saves else []
    reported = bench.done("restore", str(kept), "--arm", *save)
    assert ramp in reported
    assert bench.values(ramp, "FANMODE", "DIMMING") == {**before, "FANMODE": 1, "DIMMING": 2}


def test_own_drive_gets_only_requests_it_accepts(bench: Bench) -> None:
    """All words together: no read is longer than 8, none crosses a hole, none is refused."""
    profile = library.load_file(HERE / "profiles" / f"{bench.kind.profile}.toml")
    codes = [p.code for p in profile.parameters]
    reported = json.loads(bench.done("read", *codes, "--json"))
    assert {item["quality"] for item in reported["values"].values()} == {"good"}
    assert len(reported["values"]) == len(codes)
    bench.done("watch", "--count", "3", "--every", "0.1")
    assert bench.server.end() == (0, "0")
