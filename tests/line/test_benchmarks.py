"""The benchmarks still run: each in small, to its line of JSON.

Their results are not checked. Two of them failed unnoticed: a word on a screen had changed, and
what the line counts.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import need_peer
from tests.sources import ROOT

BENCHMARKS = ROOT / "benchmarks"
SMALL = {
    "block": "--bauds 19200 --seconds 0.5",
    "chaos": "--rounds 6 --after 9 --slack 20",
    "doctor": "--only 0A",
    "fleet": "--drives 3 --seconds 4",
    "gateway": "--seconds 0.3 --rounds 1",
    "hands": "--bursts 2 --keys 8 --ends 1 --resizes 24",
    "hostile": "--cases 20",
    "keeper": "--rounds 1 --seconds 2",
    "keys": "",
    "line": "--families atv31 --bauds 19200 --seconds 0.2",
    "line_keys": "--drives 5 --presses 5 --seconds 1",
    "record": "--seconds 0.3 --hours 0.02 --drives 3",
    "scan": "--addresses 4 --rounds 1",
    "share_soak": "--minutes 0.1",
    "shell": "--rounds 1",
    "soak": "--minutes 0.1",
    "stop": "--presses 1 --drives 2",
    "upload": "--rounds 1 --baud 115200",
}
"""The options with which each ends within a minute or, with little of a processor, within four."""
LARGE = {"instructions", "link", "panel", "share", "truth"}
"""Those that cannot be made small; they are run by hand."""
NO_BENCHMARK = {"broken_panel", "chaos_plant", "faulty_line", "in_place", "link_drive"}
"""Programs that benchmarks start."""


def test_every_benchmark_is_run_or_excluded_by_name() -> None:
    begun = {
        path.stem for path in BENCHMARKS.glob("*.py") if "\ndef main(" in path.read_text("utf-8")
    }
    assert begun == set(SMALL) | LARGE | NO_BENCHMARK


@pytest.mark.sweep
@pytest.mark.timeout(400)  # one of them runs with a tenth of a processor
@pytest.mark.parametrize("name", SMALL)
def test_short_benchmark_prints_its_figures(name: str, tmp_path: Path) -> None:
    if name == "keys" and shutil.which("tmux") is None:
        need_peer("tmux is not here; it comes with the package tmux.")
    done = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", *SMALL[name].split()],
        cwd=ROOT,
        env=os.environ | {"TMPDIR": str(tmp_path)},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:] + done.stdout[-2000:]
    assert json.loads(done.stdout.splitlines()[-1])
