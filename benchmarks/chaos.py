"""Programs ended in every way, at random moments: is the motor stopped, and do the others notice?

    python -m benchmarks.chaos [--rounds N] [--seed N] [--only TEXT] [--after S] [--lanes N]

In each round a simulated line (RTU at 9600 or 19200 baud, or Modbus TCP) outlives all programs. A
`run` or a panel runs the motor of drive 1, a `watch` observes both drives. Then the panel, the
`run`, another `watch`, a `backup` or the keeper ends. The record of the line shows the result. In
further kinds the adapter, the processor, the disk or the package fails, or, as root, a service, a
log-in or a container ends.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from statistics import median

from rich.console import Console
from rich.table import Table

from benchmarks.chaos_line import EVERY
from benchmarks.chaos_plant import PLANT_ROUNDS
from benchmarks.chaos_round import (
    BESIDE,
    COMMON,
    CRASH,
    DEAD_FROZEN,
    KILLED,
    LEFT_RUNNING,
    THAWED,
    WITH_KEEPER,
    Outcome,
    Round,
)
from benchmarks.chaos_system import SYSTEM_ROUNDS

OTHER_ROUNDS: dict[tuple[str, str], type[Round]] = {**SYSTEM_ROUNDS, **PLANT_ROUNDS}
KINDS: Sequence[tuple[str, str]] = (
    *(("run", end) for end in (*COMMON, WITH_KEEPER, LEFT_RUNNING)),
    *(("run", end + BESIDE) for end in (KILLED, DEAD_FROZEN)),
    *(("panel", end) for end in (*COMMON, WITH_KEEPER, CRASH)),
    *(("watch", end) for end in COMMON),
    *(("backup", end) for end in COMMON),
    *(("keeper", end) for end in (KILLED, "SIGTERM", DEAD_FROZEN, THAWED)),
    *OTHER_ROUNDS,
)
"""Program and end. `run`, `watch` and `backup` draw nothing, so no drawing of theirs fails."""
COLUMNS = ("program", "end", "rounds", "stops of due", "stop s: median, worst",
           "gap s: median, worst", "wrong", "unreported", "left", "broken")  # fmt: skip


def planned(rounds: int, seed: int, only: str) -> list[Outcome]:
    """Rounds with all kinds of ends alike often, in random order."""
    chance = random.Random(seed)
    kinds = [pair for pair in KINDS if re.search(only, ", ".join(pair))]
    order: list[tuple[str, str]] = []
    while len(order) < rounds:
        order += chance.sample(kinds, len(kinds))
    lines = ("9600", "19200", "TCP")
    return [
        # an adapter is unplugged from a serial line only
        Outcome(n, *kind, chance.choice(lines[: 2 if "adapter" in kind[1] else 3]))
        for n, kind in enumerate(order[:rounds])
    ]


def table_of(outcomes: Sequence[Outcome]) -> Table:
    """The rounds by kind of end."""
    table = Table(*COLUMNS, title=f"Ends of programs and keepers; a cycle takes {EVERY} s")
    for kind in KINDS:
        rounds = [
            outcome
            for outcome in outcomes
            if (outcome.program, outcome.end) == kind and not outcome.failed
        ]
        due = [outcome for outcome in rounds if outcome.due is not None]
        stops = [outcome.stop for outcome in due if outcome.stop is not None]
        gaps = [outcome.gap for outcome in rounds]
        if rounds:
            table.add_row(
                *kind, str(len(rounds)), f"{len(stops)} of {len(due)}" if due else "-",
                *(f"{median(row):.2f}, {max(row):.2f}" if row else "-" for row in (stops, gaps)),
                *(str(sum(getattr(r, name) for r in rounds)) for name in COLUMNS[-4:-1]),
                str(sum(bool(outcome.broken) for outcome in rounds)),
            )  # fmt: skip
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="kinds with this text, such as 'run, kill -9$'")
    parser.add_argument("--after", type=float, default=15.0, help="seconds watched after an end")
    parser.add_argument("--slack", type=float, default=1.5, help="seconds that a stop may be late")
    parser.add_argument("--lanes", type=int, default=3, help="rounds at the same time")
    options = parser.parse_args()
    print(f"seed {options.seed}", file=sys.stderr)

    def play(outcome: Outcome) -> Outcome:
        chance = random.Random(f"{options.seed} {outcome.number}")
        kind = OTHER_ROUNDS.get((outcome.program, outcome.end), Round)
        kind(outcome, chance, options.after, options.slack).play()
        print(json.dumps(asdict(outcome)), file=sys.stderr)
        return outcome

    with ThreadPoolExecutor(options.lanes) as lanes:
        outcomes = list(lanes.map(play, planned(options.rounds, options.seed, options.only)))
    Console(width=150).print(table_of(outcomes))
    broken = sum(bool(item.broken) for item in outcomes)
    failed = sum(bool(item.failed) for item in outcomes)
    print(f"seed {options.seed}: {broken} rounds broke a requirement, {failed} could not be played")
    print(json.dumps({"benchmark": "chaos", "seed": options.seed,
                      "rounds": [asdict(item) for item in outcomes]}))  # fmt: skip
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
