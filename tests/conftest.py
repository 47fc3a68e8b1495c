"""What every test starts from: folders of its own, one locale, no peers unless they are there."""

from __future__ import annotations

import gc
import os
import shutil
import sys
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
"""Rooms whose tests take long; all others come after them.

First of all what looks at the source: late, it is shared out, and each worker parses all of it.
"""
FOLDERS = count()

# nothing that is imported or collected is garbage; looked for again once all is collected
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


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deal the modules to the workers, the costly first: no long test is left for the end."""
    workers: int = getattr(config, "workerinput", {}).get("workercount", 1)
    if workers > 1:
        modules = [list(module) for _, module in groupby(items, _dealt_with)]
        modules.sort(key=lambda module: COSTLY_FIRST.get(module[0].path.parent.name, 9))
        dealt = [module for worker in range(workers) for module in modules[worker::workers]]
        items[:] = chain.from_iterable(dealt)


def _dealt_with(item: pytest.Item) -> Path:
    """What goes to one worker: a module; all that look at the source, which is parsed once."""
    return item.path.parent if item.path.parent == Path(__file__).parent else item.path


def pytest_collection_finish() -> None:
    """What was imported stays: a third of the time of a panel went into looking for garbage."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 10)
    gc.enable()


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Look for garbage once more: pytest's five looks at the end find all that lives put aside.

    No worker lists the pictures that it did not compare: that took seconds of each, and nobody
    reads it.
    """
    plugins = session.config.pluginmanager
    if hasattr(session.config, "workerinput") and plugins.has_plugin("syrupy"):
        plugins.unregister(name="syrupy")
    gc.collect()
    gc.freeze()


@pytest.fixture
def tmp_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of the test's own. Pytest's own one reads the whole list of folders for each."""
    folder = tmp_path_factory.getbasetemp() / str(next(FOLDERS))
    folder.mkdir(mode=0o700)
    return folder


@pytest.fixture(autouse=True)
def own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Folders of the test's own for home, configuration and state; no keeper; the log closed."""
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path / "config"))
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("DRIVEPANEL_SHARE_FOLDER", str(tmp_path / "group"))
    monkeypatch.delenv("DRIVEPANEL_LINE", raising=False)
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
    """Lines wait a whole second for every answer, unless a test gives them a timing of its own.

    A line learns how fast its devices are and waits 0.15 s at least; a simulated drive takes
    longer where the machine has something else to do.
    """

    def patient(link: Link) -> Timing:
        timing = timing_of(link)
        return replace(timing, min_timeout=timing.first_timeout)

    monkeypatch.setattr("tui.bus.line.timing_of", patient)


@pytest.fixture
def peer() -> Callable[[str, str], str]:
    """Finds a program that the project did not write.

    Skips with a plain reason where it is missing; fails where `DRIVEPANEL_PEERS` is `required`.
    """

    def find(program: str, package: str) -> str:
        if found := shutil.which(program):
            return found
        need_peer(f"{program} is not here; it comes with the package {package}.")
        raise AssertionError  # need_peer never returns

    return find


def need_peer(reason: str) -> None:
    """Skip the test for want of a peer, or fail where peers are required."""
    if os.environ.get("DRIVEPANEL_PEERS") == "required":
        pytest.fail(reason)
    pytest.skip(reason)
