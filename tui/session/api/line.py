"""A line for a script, opened by its text or its name."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from ..connect.open_line import OpenLine
from .drive import Drive
from .line_calls import LineCalls, open_for_script
from .work import waited


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
