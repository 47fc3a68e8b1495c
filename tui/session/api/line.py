"""A line for a script, opened by its text or its name; blocking, or in an asyncio loop."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import TracebackType
from typing import Self

from ..connect.open_line import OpenLine
from .async_drive import AsyncDrive
from .drive import Drive
from .line_calls import LineCalls, open_for_script
from .work import awaited, uninterrupted, waited


def open_drives(text: str, *, read_only: bool = False, accept: bool = False) -> DriveLine:
    """The line that a LINE or its name means, connected; shared as the commands share it.

    With `accept` a line that is not as it was is taken as it is now. Raises LineError.
    """
    return DriveLine(open_for_script(text, read_only=read_only, accept=accept))


class ScriptedLine:
    """State of an open line; nothing here waits."""

    def __init__(self, opened: OpenLine) -> None:
        self._calls = LineCalls(opened)

    @property
    def changed(self) -> tuple[str, ...]:
        """Differences from the stored line; while there is one, only stops are written."""
        return self._calls.changed


class DriveLine(ScriptedLine):
    """An open line. Taken drives are kept polled until it is closed."""

    def drive(self, address: int = 1, profile: str | None = None) -> Drive:
        """The drive at an address, by its own word for what it is, or by a profile's id.

        Raises DriveError where it does not say what it is, or says that it is another.
        """
        return Drive(waited(self._calls.line, lambda: self._calls.drive(address, profile)))

    def close(self) -> None:
        """Close the line. A drive with a communication timeout acts on it from now on."""
        self._calls.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


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
