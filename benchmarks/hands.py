"""Effects of typing, pastes and a hung link on a motor, counted on the wire.

    python -m benchmarks.hands [--bursts N] [--keys N] [--seed N]

The panel runs on a pseudo-terminal with one simulated Altivar 71 on Monitor, over a relay that
keeps every write. First bursts: the drive is armed, sometimes with the run line open or the motor
running, and a random burst of keys with one stop key arrives in one read or cut at random places,
as after a link that hung. The same while a question of Control, of the timeout test or of Frames is
open or its action runs, and on two panels of one line of which either gets the stop. Then keys:
random ones, single and in bursts, and each one alone, with the drive disarmed. It counts every
write that is not a stop; the count must be 0. Last, ends: every signal, resizes, keys while a line
opens, and an error in the drawing of each screen, each with a motor running.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from rich.console import Console
from rich.table import Table

from benchmarks.hands_ends import Endings, count_ends
from tests.line.pty_panel import (
    COMMAND,
    LINE_SETTLED,
    PtyPanel,
    Write,
    panel_beside,
    panel_on_a_pty,
)

REFERENCE = 8502
"""Register of the reference LFR."""
STOPS = (b" ", b"\x1b[24~", b"\x1b[20~")
"""Space, F12 and F9 as terminals send them."""
KEYS = [bytes([code]) for code in range(33, 127) if code != ord("q")]
"""Without q, which leaves a panel whose motor is at standstill, and ends the count."""
KEYS += [b"\r", b"\t", b"\x7f", b"\x1b[A", b"\x1b[B", b"\x1b[5~", b"\x1b[6~", b"\x1b", b"\x1bOP"]
TEXTS = {b"/", b"n", b"O", b"j"}
"""Keys that open a text, where a Space is one: a search, the name of a line, a filter."""
QUESTIONS: dict[str, tuple[bytes, ...]] = {
    "of Control": (b"6", b"\x1b[B", b"\r"),
    "of the proof": (b"6", b"P"),
    "of the counters": (b"7", b"\t", b"\t", b"Z"),
}
"""Keys that lead an armed drive from Monitor to a question that writes, or lets it alone."""
MIXED = (1, 1, 1, 2, 5, 20, 100)
"""Sizes of pieces of keys."""
QUIET = 0.15
"""Seconds after a piece in which whatever it does has been sent."""
LATE = 3.0
"""Seconds for a stop that is not there by then."""
AWAY = 0.12
"""Longest pause inside a piece that a link cuts, in s."""
STOP_WORDS = {7, 2, 0, 0x010F}
"""Values allowed in the command word of an Altivar 71 without a key: words that stop."""


@dataclass(slots=True)
class Counted:
    """Writes on the line."""

    pieces: int = 0
    keys: int = 0
    stops: int = 0
    runs_after_stop: int = 0
    references_after_stop: int = 0
    other_writes: int = 0
    still_armed: int = 0
    stopless: int = 0
    """Stop keys that no stop frame followed."""
    typed: int = 0
    """Spaces that went into a text which keys before them had opened."""


Lead = Callable[[PtyPanel, random.Random], None]
"""Brings a panel whose drive is armed to where a burst meets it."""


def is_stop(write: Write) -> bool:
    """Return True if the write can only stop the motor."""
    return write.register == COMMAND and write.words[0] in STOP_WORDS


def settle(panel: PtyPanel, seconds: float = QUIET, beside: PtyPanel | None = None) -> None:
    """Take what the panels draw until nothing of a piece is under way any more."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for pty_panel in (panel, beside):
            if pty_panel is not None and not pty_panel.look(0.02):
                raise SystemExit(f"the panel has ended:\n{pty_panel.text()}")


def home(panel: PtyPanel) -> None:
    """Back on Monitor, whatever a piece has opened."""
    for key in (b"\x1b", b"\x1b", b"\x1b", b"2"):
        panel.type(key)
        settle(panel, 0.4)
    panel.shows("Output", "Current")


def arm(panel: PtyPanel) -> None:
    """Arm the drive; a piece may have opened another screen or a field before."""
    for _ in range(10):
        settle(panel)
        if panel.armed and "Output" in panel.text():
            return
        if panel.armed:  # on another screen, where Enter may open a text
            home(panel)
            continue
        panel.type(b"a")
        settle(panel, 0.3)
        if not panel.armed:
            home(panel)
    raise SystemExit(f"the drive cannot be armed:\n{panel.text()}")


def send(panel: PtyPanel, chance: random.Random, keys: list[bytes]) -> None:
    """The keys in one write, or cut at random places with pauses between."""
    data = b"".join(keys)
    cuts = sorted(chance.sample(range(len(data) + 1), chance.randint(0, min(3, len(data)))))
    parts = [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True) if a < b]
    for part in parts:
        panel.type(part)
        if chance.random() < 0.5:
            time.sleep(chance.random() * AWAY)


def to_the_run_line(panel: PtyPanel, chance: random.Random) -> None:
    """One in three with the run line open, or the motor running."""
    if chance.random() < 0.3:
        panel.type(b"r")
        settle(panel)
        if chance.random() < 0.5:
            settle(panel, 0.35)
            panel.type(b"\r")
            settle(panel, 0.3)


def to_a_question(panel: PtyPanel, chance: random.Random) -> None:
    """Open a question, or just begin its action."""
    home(panel)
    arm(panel)
    for key in chance.choice([*QUESTIONS.values()]):
        panel.type(key)
        settle(panel, LINE_SETTLED)
    if chance.random() < 0.5:
        panel.type(b"y")
        settle(panel, chance.random() * QUIET)


def bursts(
    panel: PtyPanel,
    chance: random.Random,
    count: int,
    counted: Counted,
    lead: Lead = to_the_run_line,
    beside: PtyPanel | None = None,
) -> None:
    """Pieces with a stop in each, on an armed drive.

    With another panel `beside` either has the stop, and the other one some keys at the same time.
    """
    for number in range(count):
        if number % 20 == 0:
            home(panel)
        if beside is not None:
            _disarm(beside)
        arm(panel)
        lead(panel, chance)
        stopping = panel
        if beside is not None:
            stopping, other = chance.sample((panel, beside), 2)
            other.type(b"".join(chance.choices(KEYS, k=chance.randint(2, 8))))
        before_keys = chance.choices(KEYS, k=chance.randint(1, 6))
        after_keys = chance.choices(KEYS, k=chance.randint(0, 4))
        # beside, where nothing closes what keys have opened, a Space may be text
        stop = chance.choice(STOPS if stopping is panel else STOPS[1:])
        before = len(panel.log.writes)
        send(stopping, chance, [*before_keys, stop])
        settle(panel, beside=beside)
        text = stop == b" " and not TEXTS.isdisjoint(before_keys)
        if not text and not any(map(is_stop, panel.log.writes[before:])):
            settle(panel, LATE, beside=beside)  # a busy machine is not a lost stop
        sent = panel.log.writes[before:]
        counted.pieces += 1
        counted.keys += len(before_keys) + 1
        at = next((i for i, write in enumerate(sent) if is_stop(write)), None)
        typed = at is None and text
        counted.typed += typed
        counted.stopless += at is None and not typed
        counted.stops += sum(map(is_stop, sent))
        behind = Counted()
        if at is not None:
            _count(sent[at:], behind)
        counted.still_armed += not typed and not _disarmed(panel)
        if at is None and not typed:
            print(f"no stop: {before_keys} {stop!r}\n{panel.text()}", file=sys.stderr)
        if after_keys:
            mark = len(panel.log.writes)
            send(stopping, chance, after_keys)
            settle(panel, beside=beside)
            if at is not None:
                _count(panel.log.writes[mark:], behind)
            counted.keys += len(after_keys)
        counted.runs_after_stop += behind.runs_after_stop
        counted.references_after_stop += behind.references_after_stop
        counted.other_writes += behind.other_writes
        if behind != Counted():
            print(f"after a stop: {before_keys} {stop!r} {after_keys}: {sent}", file=sys.stderr)


def _disarm(panel: PtyPanel) -> None:
    """Take the drive from a panel that random keys have armed: only one panel commands it."""
    if panel.armed:
        panel.type(STOPS[1])
        _disarmed(panel)


def _disarmed(panel: PtyPanel) -> bool:
    """Return True if the screen says within a second that the drive is not armed."""
    end = time.monotonic() + 1.0
    while panel.armed and time.monotonic() < end:
        panel.look(0.02)
    return not panel.armed


def unarmed(
    panel: PtyPanel,
    chance: random.Random,
    count: int,
    counted: Counted,
    sizes: Sequence[int],
) -> None:
    """Random keys without arming, in pieces of these sizes."""
    keys = [key for key in KEYS if key != b"a"]
    home(panel)
    left = count
    while left > 0:
        size = min(left, chance.choice(sizes))
        before = len(panel.log.writes)
        panel.type(b"".join(chance.choices([*keys, b" "], k=size)))
        settle(panel, 0.08)
        sent = panel.log.writes[before:]
        counted.pieces += 1
        counted.keys += size
        counted.stops += sum(map(is_stop, sent))
        _count(sent, counted)
        left -= size


def _count(sent: list[Write], counted: Counted) -> None:
    for write in sent:
        if is_stop(write):
            continue
        if write.register == COMMAND:
            counted.runs_after_stop += 1
        elif write.register == REFERENCE:
            counted.references_after_stop += 1
        else:
            counted.other_writes += 1


def main() -> None:
    """Count, and print a table and a JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bursts", type=int, default=60)
    parser.add_argument("--keys", type=int, default=1500)
    parser.add_argument("--resizes", type=int, default=600)
    parser.add_argument("--ends", type=int, default=30, help="cases of each kind of end, at most")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    chance = random.Random(arguments.seed)
    found: dict[str, Counted] = defaultdict(Counted)
    for name, lead in (("bursts with a stop", to_the_run_line), ("at questions", to_a_question)):
        with panel_on_a_pty() as panel:
            bursts(panel, chance, arguments.bursts, found[name], lead)
    with panel_on_a_pty() as panel, panel_beside(panel) as beside:
        bursts(panel, chance, arguments.bursts, found["two panels"], beside=beside)
    for name, sizes in (("keys, not armed", MIXED), ("each by itself", (1,))):
        with panel_on_a_pty() as panel:
            unarmed(panel, chance, arguments.keys, found[name], sizes)
    ends = count_ends(chance, arguments.ends, arguments.resizes)
    table = Table("", *(name.replace("_", " ") for name in asdict(Counted())))
    for name, counted in found.items():
        table.add_row(name, *(str(number) for number in asdict(counted).values()))
    Console().print(table)
    ends_table = Table("", *(name.replace("_", " ") for name in asdict(Endings())))
    for name, counted_ends in ends.items():
        ends_table.add_row(name, *(f"{number:.3g}" for number in asdict(counted_ends).values()))
    Console().print(ends_table)
    figures = {name: asdict(item) for name, item in found.items()}
    print(json.dumps(figures | {name: asdict(endings) for name, endings in ends.items()}))


if __name__ == "__main__":
    main()
