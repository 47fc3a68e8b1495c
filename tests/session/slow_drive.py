"""A slow Altivar 312 on a line without a wire, with its commander."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from tests.waiting import until
from tui.bus.api import Priority
from tui.bus.errors import NoAnswer, RequestRefused
from tui.drive.profile import library
from tui.session.command.commander import Commander
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.starts.keeper import StartKeeper
from tui.session.starts.starts import Starts
from tui.session.work import OutcomeKind

from .fakes import OneDrive

PROFILE = library.load("atv312")
STATUS, COMMAND, FREQUENCY = (PROFILE[code].address for code in ("ETA", "CMD", "rFr"))
READY, SWITCHED_ON, ENABLED = 0x0221, 0x0223, 0x0227
GOES_TO = {0x06: READY, 0x07: SWITCHED_ON, 0x0F: ENABLED}


class SlowDrive(OneDrive):
    """An Altivar 312 whose state follows a word only after some reads."""

    def __init__(self, looks: int) -> None:
        super().__init__(dict.fromkeys(range(0x10000), 0))
        held = {"LAC": 2, "CHCF": 1, "Fr1": 164}
        self.registers.update({PROFILE[code].address: raw for code, raw in held.items()})
        self.registers[STATUS] = 0x0240
        self.looks = looks
        """Reads of the status until a word takes effect."""
        self.dead_to_writes = False
        self.words: list[tuple[int, int]] = []
        """Each command word, with the state of the drive at that time."""
        self.before_write: Callable[[int], None] = lambda _address: None
        self._coming: list[int] = []

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        if STATUS in registers and self._coming:
            self.registers[STATUS] = self._coming.pop(0)
        await asyncio.sleep(0)

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        if (forbidden := how.get("forbidden")) is not None and (why := forbidden()):
            raise RequestRefused(why)
        if self.dead_to_writes:
            raise NoAnswer(device, 6, address)
        self.before_write(address)
        self.registers[address] = values[0]
        if address == COMMAND:
            now = self.registers[STATUS]
            self.words.append((values[0], now))
            self._coming = [now] * self.looks + [GOES_TO[values[0]]]
        return time.monotonic()


class SlowBench:
    """An armed drive with its commander; starts are recorded."""

    def __init__(self, folder: Path, looks: int = 3) -> None:
        self.line = SlowDrive(looks)
        self.starts = Starts(folder)
        self.session = DriveSession(self.line, 1, PROFILE)
        self.session.starts = StartKeeper("test", self.starts)
        self.session.arming.arm(seconds=math.inf)
        self.journal = Journal()
        self.commander = Commander(self.session, self.journal)

    @property
    def records(self) -> list[Path]:
        """The recorded starts on the disk."""
        return sorted(self.starts.folder.glob("*.json"))

    async def start(self) -> tuple[OutcomeKind, str]:
        """Result of a run command."""
        self.commander.order("forward")
        await until(lambda: not self.session.work.busy)
        assert self.session.work.outcome is not None
        return self.session.work.outcome.kind, self.session.work.outcome.text

    def rest(self) -> None:
        """Bring the motor to standstill."""
        self.line.registers[STATUS] = SWITCHED_ON

    def end(self) -> None:
        """Write all pending records."""
        self.starts.close(5.0)
        self.journal.close()
