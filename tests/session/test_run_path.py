"""Path of a run command from its key to the line: the objects that hand it on."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import FrameType

from tests.sources import PACKAGE, ROOT
from tests.waiting import until

from .slow_drive import COMMAND, SlowBench

MOST_HOPS = 12
HEADING = "## The key `r`, from the screen to the frame"
PATH = ["WorkQueue", "Commander", "MotorStart", "CommandAccess"]
"""Objects between the queue of a drive and its line."""


def carriers() -> list[str]:
    """Classes of this program whose methods are in progress, from the outermost."""
    found: list[str] = []
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if Path(frame.f_code.co_filename).is_relative_to(PACKAGE) and "self" in frame.f_locals:
            found.append(type(frame.f_locals["self"]).__name__)
        frame = frame.f_back
    return list(dict.fromkeys(reversed(found)))


def documented_hops() -> list[str]:
    """Rows of the table of this path in docs/architecture.md."""
    text = (ROOT / "docs/architecture.md").read_text("utf-8")
    section = text.partition(HEADING)[2].partition("\n## ")[0]
    return re.findall(r"^\| \d+ \|.*$", section, re.MULTILINE)


async def test_run_word_passes_documented_objects_only(tmp_path: Path) -> None:
    bench = SlowBench(tmp_path)
    paths: list[list[str]] = []

    def note(address: int) -> None:
        if address == COMMAND:
            paths.append(carriers())

    bench.line.before_write = note
    bench.commander.run("forward", "20")
    await until(lambda: not bench.session.work.busy)
    bench.end()
    assert len(paths) == 3
    for path in paths:
        assert [name for name in path if name != type(bench.line).__name__] == PATH
    rows = "".join(documented_hops())
    assert [name for name in PATH if f"`{name}" not in rows] == []


def test_key_r_has_no_more_hops_than_allowed() -> None:
    rows = documented_hops()
    assert [int(row.split("|")[1]) for row in rows] == list(range(1, len(rows) + 1))
    assert 0 < len(rows) <= MOST_HOPS
