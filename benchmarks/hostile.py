"""Files, state and replies broken at random: no traceback, no hang, no command to the terminal.

    python -m benchmarks.hostile [--cases N] [--seed S] [KIND...]

10 000 cases by default, shared out among profiles, parameter sets, block files, files of the state
folder and replies of drives. A failing case is reported with its number; the same seed and number
make the same case. Exit status 1 if one failed.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from benchmarks.hostile_cases import CASES

LONGEST_CASE = 20.0
"""Seconds after which a case counts as hanging."""


class Hang(BaseException):
    """A case did not end."""


@dataclass(slots=True)
class Tally:
    """Results of the cases of one kind."""

    cases: int = 0
    slowest: float = 0.0
    slowest_case: int = 0
    failures: list[tuple[int, str]] = field(default_factory=list)


def run_case(kind: str, number: int, seed: int) -> None:
    """One case in a folder of its own; raises whatever it raises."""
    chance = random.Random(f"{seed} {kind} {number}")
    with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
        CASES[kind](chance, Path(folder))


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise Hang inside after so many seconds, where the system can."""

    def ring(_number: int, _frame: FrameType | None) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def run(kind: str, cases: int, seed: int) -> Tally:
    """So many cases of a kind."""
    tally = Tally()
    for number in range(cases):
        begun = time.perf_counter()
        try:
            with _limited(LONGEST_CASE):
                run_case(kind, number, seed)
        except Hang:
            tally.failures.append((number, f"hangs: {traceback.format_exc(limit=-3)}"))
        except Exception:
            tally.failures.append((number, traceback.format_exc(limit=-4)))
        tally.cases += 1
        took = time.perf_counter() - begun
        if took > tally.slowest:
            tally.slowest, tally.slowest_case = took, number
    return tally


def main() -> int:
    """Run the cases and report the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(CASES))
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    kinds = given.kinds or list(CASES)
    logging.disable()
    state = Path(tempfile.mkdtemp(prefix="hostile-state-"))
    os.environ["DRIVEPANEL_STATE"] = os.environ["DRIVEPANEL_CONFIG"] = str(state)
    failed = 0
    figures: dict[str, dict[str, float]] = {}
    print(f"{'kind':<10} {'cases':>6} {'s':>7} {'slowest':>9}  failed   (seed {given.seed})")
    for kind in kinds:
        begun = time.perf_counter()
        tally = run(kind, given.cases // len(kinds), given.seed)
        took = time.perf_counter() - begun
        slowest = f"{tally.slowest:.2f} s"
        print(f"{kind:<10} {tally.cases:>6} {took:>7.1f} {slowest:>9}  {len(tally.failures)}")
        failed += len(tally.failures)
        for number, text in tally.failures[:10]:
            print(f"--- {kind} {number}\n{text}", file=sys.stderr)
        figures[kind] = {"cases": tally.cases, "seconds": took, "slowest": tally.slowest}
        figures[kind] |= {"slowest_case": tally.slowest_case, "failed": len(tally.failures)}
    shutil.rmtree(state, ignore_errors=True)
    print(json.dumps({"seed": given.seed, **figures}))
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
