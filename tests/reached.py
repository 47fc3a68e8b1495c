"""Lines of the product that each test reaches, recorded by coverage.py.

As a pytest plugin (`-p tests.reached`) it records one process; `record` has all tests recorded in a
copy of the checkout, and keeps the result in a cache folder of the user's, one for a commit. Code
that runs in a process of its own, such as a keeper, is not recorded.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import sqlite3
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Generator, Sequence
from difflib import SequenceMatcher
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import platformdirs
import pytest

if TYPE_CHECKING:
    from coverage import Coverage, CoverageData

ROOT = Path(__file__).resolve().parent.parent
PARTS = "DRIVEPANEL_REACHED_PARTS"
"""The environment variable that names the folder for what each process has recorded."""
AT_IMPORT = "at import"
"""The name for all that runs before the first test."""
_TEST = re.compile(r"(?:async )?def (test_\w+)\(")
PYTEST = ("-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.reached", "--timeout", "400")


class Reach(NamedTuple):
    """Record of one test."""

    lines: int
    """Lines of the product that it reaches: the fewer, the more it is about each."""
    seconds: float
    passed: bool


def folder() -> Path:
    """The cache folder of all records."""
    return Path(platformdirs.user_cache_dir("drivepanel-tests"))


def git(*arguments: str) -> str:
    """Output of git in the checkout; raises OSError or CalledProcessError without one."""
    command = ("git", "-C", str(ROOT), *arguments)
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Recorder:
    """Writes the lines that each test of this process reaches into the folder for the parts."""

    def __init__(self, parts: Path) -> None:
        from coverage import Coverage

        self._parts = parts
        self._tests: dict[str, tuple[float, bool]] = {}
        self._coverage: Coverage = Coverage(
            data_file=str(parts / "lines"), data_suffix=True, config_file=False,
            include=[str(ROOT / "tui" / "*")], concurrency=["thread"],
        )  # fmt: skip
        self._coverage.start()
        self._coverage.switch_context(AT_IMPORT)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Record under the name of the test, its fixtures included."""
        self._coverage.switch_context(item.nodeid)
        self._tests[item.nodeid] = (0.0, True)
        begun = time.monotonic()
        try:
            return (yield)
        finally:
            passed = self._tests[item.nodeid][1]
            self._tests[item.nodeid] = (time.monotonic() - begun, passed)
            self._coverage.switch_context("")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A test that fails, or is skipped, notices nothing."""
        if not report.passed and report.nodeid in self._tests:
            self._tests[report.nodeid] = (0.0, False)

    def pytest_sessionfinish(self) -> None:
        """Save what was recorded."""
        self._coverage.stop()
        self._coverage.save()
        (self._parts / f"tests-{os.getpid()}.json").write_text(json.dumps(self._tests), "utf-8")


def pytest_configure(config: pytest.Config) -> None:
    """Record in each process that runs tests, and not in the one that distributes them."""
    parts = os.environ.get(PARTS)
    is_dealer = getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput")
    if parts and not is_dealer:
        config.pluginmanager.register(Recorder(Path(parts)))


def record(copy: Path, commit: str, tests: Sequence[str], jobs: int) -> Record:
    """Run tests in a copy of the checkout and keep the lines that each reaches.

    Named tests are added to what is recorded for the commit, of a named file also the sweeps. With
    none named, all are recorded again, and the records of other commits are deleted.
    """
    from coverage import CoverageData

    parts = folder() / f"{commit}.parts"
    shutil.rmtree(parts, ignore_errors=True)  # of a run that was ended: of another copy
    parts.mkdir(parents=True)
    environment = {**os.environ, "PYTHONPATH": str(copy), PARTS: str(parts)}
    command = [sys.executable, *PYTEST, "-n", str(jobs), "--dist", "worksteal", *tests]
    command += ["-m", "" if any(test.endswith(".py") for test in tests) else "not sweep"]
    subprocess.run(command, cwd=copy, env=environment, check=False)
    lines_file, tests_file = (folder() / f"{commit}.{name}" for name in ("lines", "json"))
    for file in () if tests else (*folder().glob("*.lines"), *folder().glob("*.json")):
        file.unlink()
    data = CoverageData(str(lines_file))
    for part in sorted(parts.glob("lines.*")):
        recorded = CoverageData(str(part))
        recorded.read()
        data.update(recorded, map_path=lambda path: Path(path).relative_to(copy).as_posix())
    known: dict[str, Sequence[object]] = {}
    if tests_file.exists():
        known = {name: rest for name, (_, *rest) in _load(tests_file).items()}
    for part in parts.glob("tests-*.json"):
        known |= _load(part)
    lines = _lines_by_test(lines_file)
    found = {name: (lines.get(name, 0), *rest) for name, rest in known.items()}
    tests_file.write_text(json.dumps(found), "utf-8")
    shutil.rmtree(parts)
    return Record([commit])


def _load(path: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = json.loads(path.read_text("utf-8"))
    return found


def _lines_by_test(whole: Path) -> dict[str, int]:
    """Count the lines that each test reaches, by the tables that coverage.py documents."""
    with sqlite3.connect(whole) as tables:
        tables.create_function("ones", 1, lambda bits: int.from_bytes(bits, "big").bit_count())
        return dict(
            tables.execute(
                "SELECT context.context, SUM(ones(numbits)) FROM line_bits"
                " JOIN context ON context.id = context_id GROUP BY context_id"
            )
        )


class Record:
    """The lines that tests have reached at some commits, for the source as it is now."""

    def __init__(self, commits: Sequence[str]) -> None:
        self.commits = commits
        """The newest first."""
        self._lines: dict[str, dict[int, set[str]]] = {}

    @cached_property
    def tests(self) -> dict[str, Reach]:
        """Each test that was recorded, by its name; what was recorded last counts."""
        return {
            renamed(commit, name): Reach(*reach)
            for commit in reversed(self.commits)
            for name, reach in _load(folder() / f"{commit}.json").items()
        }

    def lines(self, path: str) -> dict[int, set[str]]:
        """By each line of a file as it is now: the tests that reach it, and AT_IMPORT."""
        if path not in self._lines:
            found = self._lines[path] = defaultdict(set)
            for commit in self.commits:
                for line, tests in _lines_at(commit, path).items():
                    found[line] |= {renamed(commit, name) for name in tests}
        return self._lines[path]


@cache
def _moved(commit: str) -> dict[str, str]:
    """Earlier paths of files whose path has changed since a commit."""
    status = git("diff", "--name-status", "--diff-filter=R", "-M50%", commit, "--", "tui", "tests")
    rows = (line.split("\t") for line in status.splitlines())
    return {new: old for _, old, new in rows}


@cache
def renamed(commit: str, name: str) -> str:
    """The present name of a test of a commit, its parameters included."""
    if name == AT_IMPORT:
        return name
    file, _, rest = name.partition("::")
    function, bracket, parameters = rest.partition("[")
    now, names = _renamed_in(commit, file)
    return f"{now}::{names.get(function, function)}{bracket}{parameters}"


@cache
def _renamed_in(commit: str, file: str) -> tuple[str, dict[str, str]]:
    """Current path of a test file of a commit, and its renamed tests."""
    now = next((new for new, old in _moved(commit).items() if old == file), file)
    if not (ROOT / now).exists():
        return now, {}
    try:
        before = git("show", f"{commit}:{file}").splitlines()
    except subprocess.CalledProcessError:
        return now, {}
    return now, new_names(before, (ROOT / now).read_text("utf-8").splitlines())


def new_names(before: list[str], after: list[str]) -> dict[str, str]:
    """By the former name of each test of a file that was renamed: its present name."""
    old, new = (
        {number: found[1] for number, line in enumerate(lines, 1) if (found := _TEST.match(line))}
        for lines in (before, after)
    )
    kept = set(new.values())
    return {
        old[was]: new[line]
        for line, was in same_lines(before, after)
        if line in new and was in old and old[was] not in kept
    }


@cache
def _data(commit: str) -> CoverageData:
    from coverage import CoverageData

    data = CoverageData(str(folder() / f"{commit}.lines"))
    data.read()
    return data


def _lines_at(commit: str, path: str) -> dict[int, set[str]]:
    """By each line of a file as it is now: the tests that reached it at a commit."""
    old = _moved(commit).get(path, path)
    reached = {n: set(found) - {""} for n, found in _data(commit).contexts_by_lineno(old).items()}
    if not reached:
        return {}
    before = git("show", f"{commit}:{old}").splitlines()
    pairs = same_lines(before, (ROOT / path).read_text("utf-8").splitlines())
    return {line: reached[was] for line, was in pairs if was in reached}


def same_lines(before: list[str], after: list[str]) -> list[tuple[int, int]]:
    """Each line after a change with the one it was before, from 1.

    Lines that were rewritten count as those whose place they take.
    """
    found = []
    for tag, i1, i2, j1, j2 in SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if tag in ("equal", "replace"):
            found += [(j + 1, i1 + min(j - j1, i2 - i1 - 1) + 1) for j in range(j1, j2)]
    return found


def recorded() -> Record | None:
    """All that is recorded for commits that this repository has, rebased ones included."""
    files = sorted(folder().glob("*.json"), key=lambda path: path.stat().st_mtime, reverse=True)
    known = git("cat-file", "--batch-check", "--batch-all-objects", "--unordered")
    commits = {name for name, kind, _ in map(str.split, known.splitlines()) if kind == "commit"}
    kept = [path.stem for path in files if path.stem in commits]
    return Record(kept) if kept else None
