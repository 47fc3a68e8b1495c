"""One drive for a script: read, watched, written to, stopped."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import AbstractContextManager

from .drive_calls import STANDS_WITHIN, DriveCalls
from .running_motor import AsyncRunningMotor, RunningMotor
from .values import DriveValue, Sample
from .work import awaited, waited


class ScriptedDrive:
    """Identity and arming of a drive; nothing here waits."""

    def __init__(self, calls: DriveCalls) -> None:
        self._calls = calls

    @property
    def address(self) -> int:
        """Its slave address."""
        return self._calls.session.device

    @property
    def profile(self) -> str:
        """The id of its profile."""
        return self._calls.session.profile.id

    @property
    def reference(self) -> str:
        """Reference that it reports; empty if none."""
        return self._calls.session.known_identity.reference

    def armed(self) -> AbstractContextManager[None]:
        """Let the block write to this drive; a stop ends that. Raises DriveError."""
        return self._calls.armed()


class Drive(ScriptedDrive):
    """One drive of an open line. Each call waits until it is done; any thread may call."""

    def read(self, *codes: str) -> dict[str, DriveValue]:
        """Present values, by code as requested; one that the drive refuses has no value."""
        named = self._calls.named(codes)
        return waited(self._calls.line, lambda: self._calls.read(named))

    def watch(self, *codes: str, every: float = 1.0) -> Iterator[Sample]:
        """Cycle after cycle, `every` so many seconds, until the script takes no more.

        A value is good if it was read in that very cycle. Raises DriveError for a cycle time that
        is not a number from 0.05 s to a day.
        """
        feed = self._calls.watch(codes, every)
        try:
            while True:
                yield waited(self._calls.line, feed.next)
        finally:
            feed.close()

    def write(
        self, values: Mapping[str, object], *, rounded: bool = False, often: bool = False
    ) -> dict[str, str]:
        """Write settings, each read back: numbers in the parameter's unit, or as they are typed.

        Returns the results, by code. Raises NotWritten where one was not, WouldRound where the
        drive can hold only another value and `rounded` is not given, and other DriveErrors. A
        parameter that went to EEPROM 10 times in the last hour is written only with `often`.
        """
        calls, permit = self._calls, self._calls.permit()
        return waited(calls.line, lambda: calls.write(values, permit, rounded=rounded, often=often))

    def save(self, *, often: bool = False) -> str:
        """Keep the settings in the drive's EEPROM; armed. Returns what was done.

        After 10 saves in the last hour, or near the end of the EEPROM's life, another one raises
        DriveError unless `often` is given.
        """
        permit = self._calls.permit()
        return waited(self._calls.line, lambda: self._calls.save(permit, often=often))

    def running(self, reference: str | None = None, *, reverse: bool = False) -> RunningMotor:
        """Run the motor for a `with` block, which stops it at every end; armed.

        `reference` is as typed: 20Hz, 900rpm; None for the present one. Entering the block raises
        DriveError and LineError if the motor is not started. Leaving it raises NotStopped, and
        MotorStopped if the motor was stopped before.
        """
        return RunningMotor(self._calls, "reverse" if reverse else "forward", reference)

    def stop(self) -> str:
        """Stop the motor on its ramp and wait for standstill; needs no arming.

        Raises NotStopped if it does not reach standstill.
        """
        calls = self._calls
        calls.order_stop()
        return calls.stop_text(calls.fleet.stopper.wait([calls.session], STANDS_WITHIN))


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
