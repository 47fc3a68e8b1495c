"""Compile the tests once, before the workers begin; else each worker compiles all of them.

Rewriting the asserts of a module takes longer than its import. On a fresh checkout ten workers
did that at the same time, each for all modules.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

TESTS = Path(__file__).resolve().parent
FEW = 20
"""Number of modules that each worker may compile itself."""
COLLECT = (sys.executable, "-m", "pytest", "--collect-only", "-qq", "-p", "no:cacheprovider")
AT_ONCE = 2


def compile_tests() -> None:
    """Compile the test modules, unless most of them are; workers report errors."""
    missing = [path for path in TESTS.rglob("test_*.py") if not is_compiled(path)]
    if len(missing) > FEW:
        halves = [part for part in dealt(missing, AT_ONCE) if part]
        collecting = [
            subprocess.Popen(
                [*COLLECT, *map(str, part)],
                cwd=TESTS.parent, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )
            for part in halves
        ]  # fmt: skip
        for process in collecting:
            process.wait()


def is_compiled(path: Path) -> bool:
    """True if pytest has stored the bytecode of a module."""
    kept = path.parent / "__pycache__"
    return any(kept.glob(f"{path.stem}.{sys.implementation.cache_tag}-pytest-*.pyc"))


def dealt(paths: Sequence[Path], parts: int) -> list[list[Path]]:
    """Split the modules into parts of about the same size."""
    made: list[list[Path]] = [[] for _ in range(parts)]
    length = [0] * parts
    for path in sorted(paths, key=lambda item: item.stat().st_size, reverse=True):
        shortest = length.index(min(length))
        made[shortest].append(path)
        length[shortest] += path.stat().st_size
    return made
