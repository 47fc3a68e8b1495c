"""Fixtures of all tests: separate folders, one locale, peers if installed."""

from __future__ import annotations

import gc
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain, count, groupby
from pathlib import Path

import pytest
from hypothesis import settings

from tui.bus.line import Timing, timing_of
from tui.bus.link import Link
from tui.session.logs import stop_logging

from .compiled import compile_tests
from .programs import kill_keepers

# each worker and each program of a test would compile all that it imports again
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

COSTLY_FIRST = {"tests": 0, "ui": 1, "session": 2, "cli": 3, "bus": 4}
"""Packages with long tests, in order; all others follow.

Tests of the source are first: later they would be spread, and each worker would parse all of it.
"""
FOLDERS = count()

# nothing that is imported or collected is garbage; looked for again once all of it is frozen
gc.disable()

# The same examples in each run: a push fails for what it changed. To look for new examples, run
# with --hypothesis-profile=search.
settings.register_profile("drivepanel", deadline=None, derandomize=True)
settings.register_profile("search", deadline=None, max_examples=5_000)
settings.load_profile("drivepanel")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes() -> None:
    """Called once, before the workers begin."""
    compile_tests()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Called before the options are read."""
    parser.addoption("--part", metavar="K/N", help="run the Kth of N equal parts of the sweeps")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Distribute the modules to the workers, long ones first, so that no long test is last."""
    if part := config.getoption("--part"):
        number, parts = map(int, part.split("/"))
        items[:] = [item for item in items if item.get_closest_marker("sweep")][number - 1 :: parts]
    workers: int = getattr(config, "workerinput", {}).get("workercount", 1)
    if workers > 1:
        modules = [list(module) for _, module in groupby(items, _dealt_with)]
        modules.sort(key=lambda module: COSTLY_FIRST.get(module[0].path.parent.name, 9))
        dealt = [module for worker in range(workers) for module in modules[worker::workers]]
        items[:] = chain.from_iterable(dealt)


def _dealt_with(item: pytest.Item) -> Path:
    """Return the unit for one worker: a module, or all tests of the source (parsed once)."""
    return item.path.parent if item.path.parent == Path(__file__).parent else item.path


def pytest_collection_finish() -> None:
    """Freeze imported objects: garbage collection took a third of the time of a panel.

    What is garbage by now is frozen, too: to look for it takes each worker 0.3 s.
    """
    gc.freeze()
    gc.set_threshold(50_000, 20, 10)
    gc.enable()


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Collect and freeze once more, so that pytest's five collections at the end are short.

    No worker lists the pictures that it did not compare: that took seconds, for no reader.
    """
    plugins = session.config.pluginmanager
    if hasattr(session.config, "workerinput") and plugins.has_plugin("syrupy"):
        plugins.unregister(name="syrupy")
    gc.collect()
    gc.freeze()


@pytest.fixture
def tmp_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a folder for the test. Pytest's own fixture lists all folders each time."""
    folder = tmp_path_factory.getbasetemp() / str(next(FOLDERS))
    folder.mkdir(mode=0o700)
    return folder


@pytest.fixture(autouse=True)
def own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Set separate folders for home, configuration and state; no keeper; the log closed."""
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path / "config"))
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("DRIVEPANEL_SHARE_FOLDER", str(tmp_path / "group"))
    monkeypatch.delenv("DRIVEPANEL_LINE", raising=False)
    monkeypatch.setenv("DRIVEPANEL_RECORD", "off")  # a file for each line of each test takes time
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    # lines of the test itself have none; programs that it starts have
    monkeypatch.setattr("tui.bus.share.keeping.can_start", lambda: False)
    monkeypatch.setenv("LC_ALL", "C.UTF-8")
    monkeypatch.setenv("TZ", "UTC")
    yield tmp_path
    stop_logging()
    kill_keepers(tmp_path / "state" / "lines", tmp_path / "group")


@pytest.fixture
def patient_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make lines wait a whole second for every answer, unless a test sets its own timing.

    A line learns the speed of its devices and waits at least 0.15 s; a simulated drive takes
    longer on a busy machine.
    """

    def patient(link: Link) -> Timing:
        timing = timing_of(link)
        return replace(timing, min_timeout=timing.first_timeout)

    monkeypatch.setattr("tui.bus.line.timing_of", patient)


@pytest.fixture
def peer() -> Callable[[str, str], str]:
    """Return a function that finds a third-party program.

    It skips with a reason if the program is missing, or fails if `DRIVEPANEL_PEERS` is `required`.
    """

    def find(program: str, package: str) -> str:
        if found := shutil.which(program):
            return found
        need_peer(f"{program} is not installed; install the package {package}.")
        raise AssertionError  # need_peer never returns

    return find


def need_peer(reason: str) -> None:
    """Skip the test for lack of a peer, or fail if peers are required."""
    if os.environ.get("DRIVEPANEL_PEERS") == "required":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture
def in_utc(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Local times are those of UTC, as in recorded texts."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()
