"""A tenth of a processor for some programs together, as on a small computer."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

GROUPS = ("/sys/fs/cgroup/cpu", "/sys/fs/cgroup")
QUOTA, PERIOD = 10_000, 100_000
"""Microseconds of processor time in each so many."""


@contextmanager
def slow_group(name: str = "") -> Iterator[Path | None]:
    """A control group with the quota; None if this user, or this system, can make none."""
    for folder in GROUPS:
        group = Path(folder, f"drivepanel-{os.getpid()}{name}")
        with suppress(OSError):
            group.mkdir()
            try:
                if (group / "cpu.cfs_quota_us").exists():
                    (group / "cpu.cfs_quota_us").write_text(str(QUOTA))
                    (group / "cpu.cfs_period_us").write_text(str(PERIOD))
                else:
                    (group / "cpu.max").write_text(f"{QUOTA} {PERIOD}")
            except OSError:
                group.rmdir()
                continue
            try:
                yield group
            finally:
                group.rmdir()
            return
    yield None
