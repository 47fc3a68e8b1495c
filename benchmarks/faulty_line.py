"""Drives behind a line that does every wrong a line can do; a process of its own, seeded.

Every register of every drive holds a value of its own, so that a value that is taken for
another's is recognized at once. Started by `FaultyLine`, it serves a pseudo-terminal until its
input ends; with a character time it paces its replies as a real line does.
"""

from __future__ import annotations

import heapq
import json
import os
import pty
import random
import select
import struct
import subprocess
import sys
import time
import tty
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tui.wire.frames import frame

ROOT = Path(__file__).resolve().parents[1]
DEVICES = (1, 2, 3, 4)


def value_of(device: int, address: int) -> int:
    """The word of a register: no two registers of a drive, and no two drives, share one there."""
    return (address * 40503 + device * 9973) & 0xFFFF


@dataclass(frozen=True, slots=True)
class Faults:
    """Shares of replies that are hit, by kind, and by how many seconds late ones come late."""

    late: float = 0.04
    lost: float = 0.02
    duplicated: float = 0.03
    truncated: float = 0.02
    corrupted: float = 0.03
    noise: float = 0.03
    foreign: float = 0.02
    other_function: float = 0.01
    other_length: float = 0.01
    late_from: float = 0.03
    late_to: float = 0.12

    def shares(self) -> Mapping[str, float]:
        """The shares by kind."""
        reported = asdict(self)
        return {kind: share for kind, share in reported.items() if not kind.startswith("late_")}


RIGHT = ("good", "late", "duplicated", "noise")
"""Kinds of reply that bring the right bytes, whole."""


def answered_right(counts: Mapping[str, int]) -> int:
    """Replies that the line made correctly, whenever they came and whatever stood around them."""
    return sum(counts.get(kind, 0) for kind in RIGHT)


MIXED = Faults()
LATE = Faults(0.15, 0, 0, 0, 0, 0, 0, 0, 0)


@dataclass(slots=True)
class Setting:
    """Behavior of the line; times in s."""

    seed: int = 1
    faults: Faults = MIXED
    turnaround: float = 0.0005
    character: float = 0.0
    slow_once: float = 0.0
    """Seconds by which the drive is late at the tenth request. It then answers all requests in
    order; nothing else is wrong.
    """
    behind_from: int | None = None
    """From this request on, each one gets the reply to the one before; nothing else is wrong."""


class FaultyLine:
    """The line as its user sees it: a path to open, and counts of what was done to it."""

    def __init__(self, setting: Setting) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.faulty_line", json.dumps(asdict(setting))],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        self.path: str = json.loads(self._process.stdout.readline())["path"]

    def close(self) -> dict[str, int]:
        """End the line; returns how often each fault was made."""
        reported, _ = self._process.communicate(timeout=10)
        counts: dict[str, int] = json.loads(reported)
        return counts


@dataclass(slots=True)
class _Server:
    setting: Setting
    fd: int
    written: dict[tuple[int, int], int] = field(default_factory=dict)
    waiting: list[tuple[float, int, bytes]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    requests: int = 0
    pending: bytes = b""
    busy_until: float = 0.0
    held: bytes = b""
    """The reply that waits for the next request, on a line that is one behind."""

    def serve(self) -> None:
        """Answer until the input of the process ends."""
        while True:
            pause = max(0.0, self.waiting[0][0] - time.monotonic()) if self.waiting else 0.2
            ready, _, _ = select.select([self.fd, sys.stdin], [], [], pause)
            if sys.stdin in ready:
                return
            if self.fd in ready:
                self._take(os.read(self.fd, 4096))
            while self.waiting and self.waiting[0][0] <= time.monotonic():
                due, _, data = heapq.heappop(self.waiting)
                os.write(self.fd, data)
                late = round(1000 * (time.monotonic() - due))
                self.counts["ms behind time"] = max(late, self.counts.get("ms behind time", 0))

    def _take(self, data: bytes) -> None:
        self.pending += data
        while len(self.pending) >= 8:
            length = 9 + self.pending[6] if self.pending[1] == 16 else 8
            if len(self.pending) < length:
                return
            request, self.pending = self.pending[:length], self.pending[length:]
            if request == frame(request[0], request[1:-2]) and request[0] in DEVICES:
                self.requests += 1
                self._answer(request)
            else:
                self.pending = b""

    def _answer(self, request: bytes) -> None:
        right = frame(request[0], self._pdu(request))
        kind = self._kind()
        self.counts[kind or "good"] = self.counts.get(kind or "good", 0) + 1
        wait = self.setting.turnaround + self.setting.character * (len(request) + len(right))
        if self.setting.slow_once:
            wait = max(wait, self.busy_until - time.monotonic())
            self.busy_until += self.setting.turnaround
        if kind == "behind":
            right, self.held = self.held, right
            if not right:
                return
        chance = self._chance()
        for after, data in _spoilt(kind, right, chance, self.setting):
            due = time.monotonic() + wait + after
            heapq.heappush(self.waiting, (due, self.requests, data))
            if self.setting.slow_once:
                self.busy_until = max(self.busy_until, due)

    def _pdu(self, request: bytes) -> bytes:
        device, address = request[0], int.from_bytes(request[2:4], "big")
        number = int.from_bytes(request[4:6], "big")
        if request[1] == 6:
            self.written[device, address] = number
            return request[1:6]
        if request[1] == 16:
            sent = struct.unpack_from(f">{number}H", request, 7)
            new = {(device, address + at): word for at, word in enumerate(sent)}
            if new.items() <= self.written.items():
                self.counts["written again"] = self.counts.get("written again", 0) + 1
            self.written.update(new)
            return request[1:6]
        places = range(address, address + number)
        words = [self.written.get((device, at & 0xFFFF), value_of(device, at)) for at in places]
        return bytes([3, 2 * number]) + b"".join(word.to_bytes(2, "big") for word in words)

    def _chance(self) -> random.Random:
        return random.Random(self.setting.seed * 1_000_003 + self.requests)

    def _kind(self) -> str:
        if self.setting.behind_from is not None:
            return "behind" if self.requests > self.setting.behind_from else ""
        if self.setting.slow_once:
            return "late" if self.requests == 10 else ""
        drawn = random.Random(self.setting.seed * 7_919 + self.requests).random()
        for kind, share in self.setting.faults.shares().items():
            if drawn < share:
                return kind
            drawn -= share
        return ""


def _spoilt(
    kind: str, right: bytes, chance: random.Random, setting: Setting
) -> list[tuple[float, bytes]]:
    """Sequence sent instead of the correct reply: seconds to wait, and bytes."""
    cut = chance.randrange(1, len(right))
    late = setting.slow_once or chance.uniform(setting.faults.late_from, setting.faults.late_to)
    other = DEVICES[(DEVICES.index(right[0]) + 1) % len(DEVICES)]
    wrong = bytes([right[cut] ^ 1 << chance.randrange(8)])
    body = right[1:-2]
    made: dict[str, list[tuple[float, bytes]]] = {
        "": [(0.0, right)],
        "behind": [(0.0, right)],
        "late": [(late, right)],
        "lost": [],
        "duplicated": [(0.0, right), (0.004, right)],
        "truncated": [(0.0, right[:cut])],
        "corrupted": [(0.0, right[:cut] + wrong + right[cut + 1 :])],
        "noise": [(0.0, chance.randbytes(chance.randrange(1, 6)) + right)],
        "foreign": [(0.0, frame(other, body))],
        "other_function": [(0.0, frame(right[0], bytes([4]) + body[1:]))],
        "other_length": [(0.0, frame(right[0], _longer(body)))],
    }
    return made[kind]


def _longer(body: bytes) -> bytes:
    """A well-formed reply with one word more than requested or written."""
    if body[0] == 3:
        return bytes([3, body[1] + 2]) + body[2:] + body[-2:]
    return body[:-1] + bytes([body[-1] + 1])


def main() -> None:
    """Serve the line that the only argument describes."""
    reported = json.loads(sys.argv[1])
    setting = Setting(**(reported | {"faults": Faults(**reported["faults"])}))
    master, slave = pty.openpty()
    tty.setraw(slave)
    print(json.dumps({"path": os.ttyname(slave)}), flush=True)
    server = _Server(setting, master)
    server.serve()
    print(json.dumps(server.counts), flush=True)


if __name__ == "__main__":
    main()
