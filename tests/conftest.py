"""What every test starts from: folders of its own, one locale, no peers unless they are there."""

from __future__ import annotations

import gc
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import settings

from tui.bus.line import Timing, timing_of
from tui.bus.link import Link
from tui.cli.shared.logs import stop_logging

# each worker and each program of a test would compile all that it imports again
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

settings.register_profile("drivepanel", deadline=None)
settings.load_profile("drivepanel")


def pytest_collection_finish() -> None:
    """What was imported stays: a third of the time of a panel went into looking for garbage."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 10)


@pytest.fixture(autouse=True)
def own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Home, configuration and state folders that belong to the test, and a log closed after it."""
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path / "config"))
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "state"))
    monkeypatch.delenv("DRIVEPANEL_LINE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("LC_ALL", "C.UTF-8")
    monkeypatch.setenv("TZ", "UTC")
    yield tmp_path
    stop_logging()


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
