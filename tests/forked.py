"""Runs tests in forks of one process that has imported and collected them all.

As a pytest plugin (`-p tests.forked`) it waits for requests instead of running tests. `Forks` is
its client: a fork begins in milliseconds, a new process of pytest in seconds. A defect is planted
in a fork by the code of its function; a change that runs at import needs a process of its own.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from itertools import chain, zip_longest
from pathlib import Path
from typing import IO, Any, NamedTuple

import pytest

from tests import sources
from tests.sources import ROOT
from tests.swapped import NotSwapped, functions_by_file, swap

PIPES = "DRIVEPANEL_FORKED_PIPES"
"""The environment variable with two file descriptors: of requests, and of results."""
MOST_ALIKE = 8
"""Tests of one function with different parameters, if the function is requested as a whole."""
PYTEST = (
    "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "tests.forked",
    "--capture=sys", "--timeout", "60", "-m", "",
)  # fmt: skip
LONGEST = 300.0
"""Seconds for a fork."""
HUNG = "hung"


class Result(NamedTuple):
    """The result of one fork."""

    failed: str
    """The first test that failed, or was running when the fork hung; empty if all passed."""
    not_swapped: str = ""
    """Why the defect cannot be planted in a fork."""
    ran: int = 0


# -- in the process that forks ---------------------------------------------------------------------


class Forker:
    """Serves requests until the pipe of them is closed."""

    def __init__(self, session: pytest.Session) -> None:
        self._session = session
        self._items = {item.nodeid: item for item in session.items}
        self._functions = functions_by_file()
        self._failed = ""

    def serve(self, requests: IO[str], results: IO[str]) -> None:
        """Answer each request with one line."""
        threads = [thread.name for thread in threading.enumerate()]
        assert threads == ["MainThread"], f"a fork would lose {threads}"
        for line in requests:
            results.write(json.dumps(self._answer(json.loads(line))) + "\n")
            results.flush()

    def _answer(self, request: dict[str, Any]) -> Result:
        reads, writes = os.pipe()
        child = os.fork()
        if not child:
            os.close(reads)
            os.setsid()
            with os.fdopen(writes, "w") as writer:
                self._run(request, writer)
        os.close(writes)
        try:
            return self._followed(reads, request["seconds"])
        finally:
            os.close(reads)
            with suppress(ProcessLookupError):
                os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)

    def _followed(self, reads: int, seconds: float) -> Result:
        """The result of a fork, which names each test before it runs it."""
        ends = time.monotonic() + seconds
        text = b""
        while (left := ends - time.monotonic()) > 0:
            if select.select([reads], [], [], left)[0]:
                if not (piece := os.read(reads, 65536)):
                    break
                text += piece
                if text.endswith(b"}\n"):
                    break
        lines = text.decode().splitlines()
        if lines and lines[-1].startswith("{"):
            return Result(**json.loads(lines[-1]))
        return Result(lines[-1] if lines else HUNG, ran=len(lines))

    def _run(self, request: dict[str, Any], writer: IO[str]) -> None:
        """Run the tests in the fork, and end it."""
        ran = 0
        result = Result("")
        sources.tree_of.cache_clear()  # tests that check the source must see the defect
        sources.walked.cache_clear()
        try:
            if request["path"]:
                file = str(Path.cwd() / request["path"])
                swap(self._functions.get(file, ()), file, request["before"], request["after"])
            with tempfile.TemporaryDirectory(prefix="forked-") as folder:
                factory = self._session.config._tmp_path_factory  # type: ignore[attr-defined]
                factory._basetemp = Path(folder)
                ran = self._run_tests(request["tests"], writer)
            result = Result(self._failed, ran=ran)
        except NotSwapped as why:
            result = Result("", str(why))
        except BaseException as error:  # the fork must end here
            result = Result(self._failed, repr(error), ran)
        finally:
            writer.write(json.dumps(result._asdict()) + "\n")
            writer.flush()
            os._exit(0)

    def _run_tests(self, names: Sequence[str], writer: IO[str]) -> int:
        """Run tests until the first one fails; return how many ran."""
        items = [self._items[name] for name in chain(*map(self._of, names))]
        for count, (item, following) in enumerate(zip_longest(items, items[1:]), 1):
            writer.write(item.nodeid.replace("\n", " ") + "\n")
            writer.flush()
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if self._failed:
                return count
        return len(items)

    def _of(self, chosen: str) -> list[str]:
        """The tests of a name: one, those of a file, or some of a function with parameters."""
        if chosen in self._items:
            return [chosen]
        if chosen.endswith(".py"):
            return [name for name in self._items if name.startswith(f"{chosen}::")]
        found = [name for name in self._items if name.startswith(f"{chosen}[")]
        return found[:: len(found) // MOST_ALIKE + 1]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember the first failure, of a fixture too."""
        if report.failed and not self._failed:
            self._failed = report.nodeid


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool:
    """Serve requests instead of running what was collected."""
    reads, writes = map(int, os.environ.pop(PIPES).split())
    os.set_inheritable(reads, False)
    os.set_inheritable(writes, False)
    forker = Forker(session)
    session.config.pluginmanager.register(forker)
    with os.fdopen(reads) as requests, os.fdopen(writes, "w") as results:
        results.write("ready\n")
        results.flush()
        forker.serve(requests, results)
    return True


# -- client ----------------------------------------------------------------------------------------


def _collected(copy: Path) -> list[str]:
    """Files of tests, of all layers."""
    return sorted(path.relative_to(copy).as_posix() for path in (copy / "tests").rglob("test_*.py"))


class Forks:
    """A process that has collected all tests of a copy, and forks for each request."""

    def __init__(self, copy: Path, collected: Sequence[str] = ()) -> None:
        self._copy, self._chosen = copy, collected
        self._begin()

    def _begin(self) -> None:
        copy, collected = self._copy, self._chosen
        requests, self._requests = os.pipe()
        self._results, results = os.pipe()
        environment = {
            **os.environ, "PYTHONPATH": f"{copy}{os.pathsep}{ROOT}",
            PIPES: f"{requests} {results}",
        }  # fmt: skip
        self._log = tempfile.TemporaryFile("w+")  # noqa: SIM115
        self._process = subprocess.Popen(
            (sys.executable, *PYTEST, *(collected or _collected(copy))),
            cwd=copy, env=environment, stdin=subprocess.DEVNULL, stdout=self._log,
            stderr=subprocess.STDOUT, pass_fds=(requests, results),
        )  # fmt: skip
        os.close(requests)
        os.close(results)
        self._lines = os.fdopen(self._results)
        self._is_ready = False

    def run(
        self, tests: Sequence[str], path: str = "", before: str = "", after: str = "",
        seconds: float = LONGEST,
    ) -> Result:  # fmt: skip
        """Run tests in a fork until one fails, with a source of a file instead of another.

        If that ends the process that forks, which a defect can do, another one begins, and the
        fork counts as hung before its first test.
        """
        request = {
            "tests": tests, "path": path, "before": before, "after": after, "seconds": seconds,
        }  # fmt: skip
        self._await_ready()
        os.write(self._requests, json.dumps(request).encode() + b"\n")
        if answer := self._lines.readline():
            return Result(*json.loads(answer))
        self.close()
        self._begin()
        return Result(HUNG)

    def _await_ready(self) -> None:
        """Wait until the tests are collected; several processes may begin at the same time."""
        if not self._is_ready and self._lines.readline() != "ready\n":
            self._process.wait()
            self._log.seek(0)
            raise RuntimeError(self._log.read()[-3000:])
        self._is_ready = True

    def close(self) -> None:
        """End the process."""
        os.close(self._requests)
        self._lines.close()
        self._process.kill()
        self._process.wait()
        self._log.close()
