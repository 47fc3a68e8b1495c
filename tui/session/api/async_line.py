"""A line for a script that runs an asyncio loop."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from .async_drive import AsyncDrive
from .line import ScriptedLine
from .line_calls import open_for_script
from .work import awaited, uninterrupted


class AsyncDriveLine(ScriptedLine):
    """An open line, as `DriveLine`; tasks of any asyncio loop may call."""

    async def drive(self, address: int = 1, profile: str | None = None) -> AsyncDrive:
        """As `DriveLine.drive`."""
        calls = self._calls
        return AsyncDrive(await awaited(calls.line, lambda: calls.drive(address, profile)))

    async def close(self) -> None:
        """As `DriveLine.close`; closed to the end even if this task is cancelled."""
        await uninterrupted(self._calls.close)


@asynccontextmanager
async def open_drives_async(
    text: str, *, read_only: bool = False, accept: bool = False
) -> AsyncIterator[AsyncDriveLine]:
    """Open a line for a block, as `open_drives` does. Raises LineError."""
    opened: list[AsyncDriveLine] = []

    def work() -> None:
        opened.append(AsyncDriveLine(open_for_script(text, read_only=read_only, accept=accept)))

    try:
        await uninterrupted(work)
        yield opened[0]
    finally:
        for line in opened:
            await line.close()
