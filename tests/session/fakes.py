"""A line without a wire: registers in a dictionary, refusals by address, a log of requests."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import cast

import msgspec

from tui.bus.errors import DeviceException, NoAnswer
from tui.bus.limits import Limits
from tui.bus.line import DeviceState, Line, Priority, Reply
from tui.bus.link import SerialLink
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ProfileData


class FakeLine:
    """Answers reads as one drive would; `requests` lists what was asked."""

    def __init__(self, registers: Mapping[int, int], *, unknown_word: int | None = None) -> None:
        self.link = SerialLink("/dev/null")
        self.registers = dict(registers)
        self.refused: dict[int, int] = {}
        self.unknown_word = unknown_word
        self.silent = False
        self.requests: list[tuple[int, int]] = []
        self.limits: dict[int, Limits] = {}
        self.turnaround: float | None = None

    def device_state(self, device: int) -> DeviceState:
        return DeviceState(None, 0, None, None, self.turnaround, self.turnaround, None)

    def describe(self, device: int, limits: Limits) -> None:
        self.limits[device] = limits

    async def read(
        self, device: int, address: int, count: int = 1, *, priority: Priority = Priority.POLL
    ) -> Reply:
        self.requests.append((address, count))
        if self.silent:
            raise NoAnswer(device, 3, address)
        span = range(address, address + count)
        missing = [a for a in span if a not in self.registers or a in self.refused]
        if missing and (self.unknown_word is None or len(missing) == count):
            code = self.refused.get(missing[0], 2)
            raise DeviceException(device, 3, address, code, "refused")
        words = (self.unknown_word if a in missing else self.registers[a] for a in span)
        return Reply(tuple(cast("int", word) for word in words), time.monotonic())

    def as_line(self) -> Line:
        return cast("Line", self)


def parameter(code: str, address: int, **more: object) -> dict[str, object]:
    """One parameter table with the fields that a test does not care about filled in."""
    return {
        "code": code,
        "name": code.lower(),
        "number": f"W{address}",
        "address": address,
        "access": "rw",
        "group": "All",
        "source": "manual",
        "confidence": "manual",
        **more,
    }


def profile_of(*parameters: dict[str, object], **tables: object) -> Profile:
    """A small profile; `tables` replaces or adds whole tables."""
    data = {
        "profile": {"id": "small", "name": "Small", "vendor": "Nobody", "version": "1"},
        "link": {"baud": 19200, "format": "8E1"},
        "sources": [{"id": "manual", "title": "None"}],
        "functions": [{"code": 3, "name": "Read", "max_read": 29}],
        "monitoring": {"values": []},
        "parameters": list(parameters),
        **tables,
    }
    return Profile(msgspec.convert(data, ProfileData))
