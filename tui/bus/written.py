"""Message about registers or coils of a device that a program on the line has written."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from .bounds import DeviceId, MonotonicTime, RegisterValue, WrittenPlace
from .program import Program

MOST_WRITTEN = 125
"""Registers of one write."""


class DeviceWritten(msgspec.Struct, frozen=True, tag=True):
    """Registers that a device has acknowledged; device 0 is a broadcast, which none does."""

    device: DeviceId
    address: WrittenPlace
    values: Annotated[tuple[RegisterValue, ...], Meta(max_length=MOST_WRITTEN)]
    program: Program
    time: MonotonicTime
    """When the last byte of the reply came."""

    @property
    def words(self) -> dict[int, int]:
        """The written words by place; a coil is a word of 0 or 1."""
        return dict(enumerate(self.values, self.address))
