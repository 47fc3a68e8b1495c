"""Plant defects one at a time in a copy of the panel, and report those that no test notices.

    python -m tests.mutants [NAME...] [--list] [--jobs N] [--table]
    python -m tests.mutants --random N [--seed S] [--stop-path] [--package NAME] | --again
    python -m tests.mutants --coverage [TEST...]

The defects are in `tests/defects/`; random ones are made by `tests/mutator.py`. The checkout is
never changed: each worker has a copy of its own in a temporary folder. Exit status 1 if a defect
survives or no longer fits the code.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import TypeVar

from tests.defects import (
    acceptance,
    bus,
    commanding,
    counting,
    diagnosis,
    drive,
    finding,
    gateway,
    hands,
    identity,
    lines,
    listening,
    plans,
    publishing,
    records,
    scripts,
    sharing,
    teaching,
    terminal,
    watching,
)
from tests.defects.defect import Defect

ROOT = Path(__file__).resolve().parent.parent
COPIED = (
    "tui", "tests", "benchmarks", "profiles", "docs", "systemd", "pyproject.toml",
    "constraints.txt", "hatch_build.py", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE",
)  # fmt: skip
DEFECTS: tuple[Defect, ...] = (
    *acceptance.DEFECTS,
    *bus.DEFECTS,
    *drive.DEFECTS,
    *commanding.DEFECTS,
    *watching.DEFECTS,
    *records.DEFECTS,
    *scripts.DEFECTS,
    *identity.DEFECTS,
    *lines.DEFECTS,
    *listening.DEFECTS,
    *finding.DEFECTS,
    *diagnosis.DEFECTS,
    *teaching.DEFECTS,
    *terminal.DEFECTS,
    *gateway.DEFECTS,
    *hands.DEFECTS,
    *plans.DEFECTS,
    *publishing.DEFECTS,
    *sharing.DEFECTS,
    *counting.DEFECTS,
)
LAST_RUN = Path(tempfile.gettempdir()) / "drivepanel-mutants.json"
"""Latest result of each defect; `--table` shows it."""
PYTEST = ("-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--timeout", "60", "-m", "")
LONGEST = 300.0
"""Seconds for the tests of one defect; a longer hang counts as noticed, too."""
T = TypeVar("T")
R = TypeVar("R")
SURVIVED, STALE = "SURVIVED", "STALE"
_FAILED = re.compile(r"^(?:FAILED|ERROR) ([^\s\[:]+::[^\s\[]+)", re.MULTILINE)


class Stale(Exception):
    """A defect that no longer fits the code or the tests; the text says why."""


@dataclass(frozen=True, slots=True)
class Planted:
    """Result of one defect."""

    name: str
    noticed_by: str
    """The test that failed first, else SURVIVED, or STALE with the reason."""
    seconds: float

    @property
    def noticed(self) -> bool:
        """True if a test failed because of it."""
        return not self.noticed_by.startswith((SURVIVED, STALE))


def place_of(defect: Defect, root: Path) -> Path:
    """Return the only file with the defect's old text, which it has once; raises Stale."""
    room = root / defect.room
    files = sorted(room.rglob("*.py")) if room.is_dir() else [room]
    found = [
        path
        for path in files
        if path.is_file()
        for _ in range(path.read_text("utf-8").count(defect.old))
    ]
    if len(found) != 1:
        raise Stale(f"its text appears {len(found)} times in {defect.room}")
    return found[0]


def _forget_compiled(path: Path) -> None:
    """Remove the bytecode: Python would reuse it for a new file of the same size and age."""
    for compiled in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
        compiled.unlink()


def planted(defect: Defect, copy: Path) -> AbstractContextManager[None]:
    """Plant the defect in the copy for the block, then restore it. Raises Stale."""
    path = place_of(defect, copy)
    return replaced(path, path.read_text("utf-8").replace(defect.old, defect.new))


@contextmanager
def replaced(path: Path, text: str) -> Iterator[None]:
    """Replace the text of a file for the block, then restore it."""
    whole = path.read_text("utf-8")
    try:
        path.write_text(text, "utf-8")
        _forget_compiled(path)
        yield
    finally:
        path.write_text(whole, "utf-8")
        _forget_compiled(path)


def run_tests(tests: Iterable[str], copy: Path, *more: str) -> tuple[int, str]:
    """Return exit status and output of pytest in a copy; -1 if it hung."""
    command = (sys.executable, *PYTEST, *more, *tests)
    # the copy's own packages, whatever is installed
    surroundings = {**os.environ, "PYTHONPATH": str(copy)}
    try:
        done = subprocess.run(
            command, cwd=copy, env=surroundings, capture_output=True, text=True, timeout=LONGEST
        )
    except subprocess.TimeoutExpired:
        return -1, ""
    return done.returncode, done.stdout + done.stderr


def judge(status: int, output: str) -> str:
    """Name the test that noticed a defect; only a test that ran and failed counts."""
    if status == 0:
        return SURVIVED
    if status == -1:
        return f"a hang of more than {LONGEST:g} s"
    first = _FAILED.search(output)
    if status != 1 or first is None:
        lines = [line for line in output.splitlines() if line.strip()] or ["no output"]
        return f"{STALE}: no test ran ({lines[-1][:100]})"
    return first[1].rstrip(":")


def plant(defect: Defect, copy: Path) -> Planted:
    """Plant one defect in a copy and run its tests."""
    begun = time.monotonic()
    try:
        with planted(defect, copy):
            by = judge(*run_tests(defect.tests, copy))
    except Stale as stale:
        by = f"{STALE}: {stale}"
    return Planted(defect.name, by, time.monotonic() - begun)


@contextmanager
def copies(count: int) -> Iterator[list[Path]]:
    """Make copies of the current checkout and delete them after the block."""
    with tempfile.TemporaryDirectory(prefix="drivepanel-mutants-") as folder:
        made = [Path(folder) / str(number) for number in range(count)]
        for copy in made:
            copy.mkdir()
            for name in COPIED:
                source = ROOT / name
                if source.is_dir():
                    leave = shutil.ignore_patterns("__pycache__")
                    shutil.copytree(source, copy / name, ignore=leave)
                elif source.exists():
                    shutil.copy2(source, copy / name)
        yield made


def fit_to_judge(defects: Sequence[Defect], copy: Path) -> str:
    """Return why the tests cannot judge, or an empty text; they must pass with nothing planted."""
    shown = subprocess.run(
        (sys.executable, "-c", "import tui; print(tui.__file__)"),
        cwd=copy, env={**os.environ, "PYTHONPATH": str(copy)}, capture_output=True, text=True,
    )  # fmt: skip
    if not shown.stdout.startswith(str(copy)):
        return f"the tests would run against {shown.stdout.strip() or shown.stderr}"
    tests = dict.fromkeys(test for defect in defects for test in defect.tests)
    status, output = run_tests(tests, copy)
    if status == 0:
        return ""
    return f"without any defect: {judge(status, output)}\n{output[-2000:]}"


def plant_all(defects: Sequence[Defect], jobs: int) -> list[Planted]:
    """Plant them one after another in each of `jobs` copies; print each result at once."""
    with copies(jobs) as made:
        if why := fit_to_judge(defects, made[0]):
            raise SystemExit(f"The tests cannot judge: {why}")

        def show(result: Planted) -> None:
            remember(result)
            print(f"{result.seconds:6.1f} s  {result.name}: {result.noticed_by}", flush=True)

        return dealt(plant, defects, made, show)


def dealt(
    work: Callable[[T, Path], R],
    items: Sequence[T],
    made: Sequence[Path],
    show: Callable[[R], None],
) -> list[R]:
    """Do the work for each item in the next free copy; show each result at once."""
    free: SimpleQueue[Path] = SimpleQueue()
    showing = Lock()
    for copy in made:
        free.put(copy)

    def once(item: T) -> R:
        copy = free.get()
        try:
            result = work(item, copy)
        finally:
            free.put(copy)
        with showing:
            show(result)
        return result

    with ThreadPoolExecutor(len(made)) as pool:
        return list(pool.map(once, items))


def last_run() -> dict[str, Planted]:
    """Return the latest result of each defect, by name."""
    try:
        reported = json.loads(LAST_RUN.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return {name: Planted(**item) for name, item in reported.items()}


def remember(result: Planted) -> None:
    """Store a result with those of earlier defects."""
    names = {defect.name for defect in DEFECTS}
    kept = {**last_run(), result.name: result}
    reported = {name: asdict(planted) for name, planted in kept.items() if name in names}
    LAST_RUN.write_text(json.dumps(reported, indent=1), "utf-8")


def table(results: dict[str, Planted]) -> str:
    """Return all defects with their results, as Markdown."""
    lines = ["| defect | consequence for a person | noticed by | s |", "|---|---|---|---:|"]
    for defect in DEFECTS:
        planted = results.get(defect.name)
        by, seconds = (
            ("not planted", "")
            if planted is None
            else (planted.noticed_by, f"{planted.seconds:.0f}")
        )
        by = by.removeprefix("tests/").replace("|", "\\|")
        lines.append(f"| `{defect.name}` | {defect.suffers} | {by} | {seconds} |")
    noticed = sum(result.noticed for result in results.values())
    return "\n".join([*lines, "", f"{noticed} of {len(DEFECTS)} defects are noticed."])


def _chosen(names: Sequence[str]) -> list[Defect]:
    known = {defect.name: defect for defect in DEFECTS}
    if strange := [name for name in names if name not in known]:
        raise SystemExit(f"There is no defect {strange[0]!r}; --list names them.")
    return [known[name] for name in names] if names else list(DEFECTS)


def _listed(defects: Iterable[Defect]) -> int:
    """Print the defects, and the reason for each stale one; return 1 if there are any."""
    stale = 0
    for defect in defects:
        print(f"{defect.name:42} {defect.room:32} {defect.suffers}")
        try:
            place_of(defect, ROOT)
        except Stale as why:
            stale += 1
            print(f"    {STALE}: {why}")
    return 1 if stale else 0


def main() -> int:
    """Plant the selected defects; return 1 if one survives."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="only these defects, or tests")
    parser.add_argument("--list", action="store_true", help="name the defects, plant nothing")
    parser.add_argument("--table", action="store_true", help="the last results as Markdown")
    parser.add_argument("--jobs", type=int, default=2, choices=(1, 2), help="copies at work")
    options = parser.add_argument_group("random defects")
    options.add_argument("--random", type=int, metavar="N", help="plant N random defects")
    options.add_argument("--seed", type=int, default=1, help="which ones (default: 1)")
    options.add_argument(
        "--package", metavar="NAME", action="append", help="only in this folder of tui; repeatable"
    )
    options.add_argument("--stop-path", action="store_true", help="only where a stop passes")
    options.add_argument("--again", action="store_true", help="those not noticed the last time")
    options.add_argument("--coverage", action="store_true", help="record what each test reaches")
    requested = parser.parse_args()
    if requested.random or requested.again or requested.coverage:
        from tests import random_defects

        return random_defects.main(requested)
    if requested.table:
        print(table(last_run()))
        return 0
    defects = _chosen(requested.names)
    if requested.list:
        return _listed(defects)
    results = plant_all(defects, min(requested.jobs, len(defects)))
    missed = [result for result in results if not result.noticed]
    print(f"\n{'defect':42} {'s':>6}  noticed by")
    for result in results:
        print(f"{result.name:42} {result.seconds:6.1f}  {result.noticed_by}")
    print(f"\n{len(results) - len(missed)} of {len(results)} defects are noticed.")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
