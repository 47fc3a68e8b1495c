"""One drive for a script that runs an asyncio loop."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping

from .drive import ScriptedDrive
from .drive_calls import STANDS_WITHIN
from .running_motor import AsyncRunningMotor
from .values import DriveValue, Sample
from .work import awaited


class AsyncDrive(ScriptedDrive):
    """The calls of `Drive`, awaited; tasks of any asyncio loop may call.

    If a task that waits is cancelled, nothing more of its call is sent. An exchange in flight and a
    stop end as usual.
    """

    async def read(self, *codes: str) -> dict[str, DriveValue]:
        """As `Drive.read`."""
        named = self._calls.named(codes)
        return await awaited(self._calls.line, lambda: self._calls.read(named))

    async def watch(self, *codes: str, every: float = 1.0) -> AsyncIterator[Sample]:
        """As `Drive.watch`, for `async for`."""
        feed = self._calls.watch(codes, every)
        try:
            while True:
                yield await awaited(self._calls.line, feed.next)
        finally:
            feed.close()

    async def write(
        self, values: Mapping[str, object], *, rounded: bool = False, often: bool = False
    ) -> dict[str, str]:
        """As `Drive.write`."""
        calls, permit = self._calls, self._calls.permit()
        return await awaited(
            calls.line, lambda: calls.write(values, permit, rounded=rounded, often=often)
        )

    async def save(self, *, often: bool = False) -> str:
        """As `Drive.save`."""
        permit = self._calls.permit()
        return await awaited(self._calls.line, lambda: self._calls.save(permit, often=often))

    def running(self, reference: str | None = None, *, reverse: bool = False) -> AsyncRunningMotor:
        """As `Drive.running`, for `async with`."""
        return AsyncRunningMotor(self._calls, "reverse" if reverse else "forward", reference)

    async def stop(self) -> str:
        """As `Drive.stop`; the stop is carried out even if this task is cancelled."""
        calls = self._calls
        calls.order_stop()
        return calls.stop_text(await calls.fleet.stopper.ended([calls.session], STANDS_WITHIN))
