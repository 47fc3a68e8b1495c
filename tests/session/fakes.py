"""A fake line with one drive on it, and small profiles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from tui.bus.api import Priority, Reply
from tui.bus.fake import FakeLine
from tui.bus.fake_device import FakeDevice
from tui.bus.requests import Read
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import ProfileData


class BlockDrive(FakeDevice):
    """A drive that returns its own word for missing words of a block."""

    unknown_word = 0x8000

    def held(self, address: int, count: int) -> tuple[int, ...]:
        span = range(address, address + count)
        if not any(number in self.words for number in span):
            return super().held(address, count)
        return tuple(self.words.get(number, self.unknown_word) for number in span)


class OneDrive(FakeLine):
    """A line with one drive; `requested` lists the reads."""

    def __init__(self, registers: Mapping[int, int], *, device: int = 1) -> None:
        super().__init__({device: registers})
        self.device = device

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        priority = how.get("priority", Priority.POLL)
        await self.before_read(device, range(address, address + count), priority)
        return await super().read(device, address, count, **how)

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        """Hook of a test before the drive answers; its exception becomes the result."""

    @property
    def registers(self) -> dict[int, int]:
        """Values of the drive."""
        return self.devices[self.device].words

    @property
    def requested(self) -> list[tuple[int, int]]:
        """Address and count of all reads so far."""
        return [
            (request.address, request.count)
            for request in self.requests
            if isinstance(request, Read)
        ]


def parameter(code: str, address: int, **more: object) -> dict[str, object]:
    """One parameter table with defaults for the fields that do not matter to a test."""
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
