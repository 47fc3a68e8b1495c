"""Finds errors of the program itself that it has caught and logged, and then gone on.

A defect in a listener, a worker or a message of another program ends in the log: without this, no
test would fail by it.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest

from tui.bus.errors import LineError

OF_THE_SURROUNDINGS = (OSError, LineError)
"""Errors that a port, a disk or a loaded machine may cause."""


class InternalErrors:
    """Errors that the program has logged with their traceback since they were last cleared."""

    def __init__(self) -> None:
        self.records: list[logging.LogRecord] = []
        self._make = logging.getLogRecordFactory()
        # not a handler: the program replaces those of its own logger
        logging.setLogRecordFactory(self._note)

    def _note(self, *args: object, **named: object) -> logging.LogRecord:
        record = self._make(*args, **named)
        error = record.exc_info[1] if record.exc_info else None
        is_own = isinstance(error, Exception) and not isinstance(error, OF_THE_SURROUNDINGS)
        if is_own and record.levelno >= logging.ERROR:
            self.records.append(record)
        return record

    def __str__(self) -> str:
        shown = logging.Formatter("%(name)s: %(message)s")
        return "\n".join(map(shown.format, self.records))


INTERNAL_ERRORS = InternalErrors()


@pytest.fixture(autouse=True)
def no_internal_errors(request: pytest.FixtureRequest) -> Iterator[None]:
    """Fail a test in which the program caught an error of its own.

    A test that plants such an error has the mark `internal_errors`.
    """
    INTERNAL_ERRORS.records.clear()
    yield
    planted = request.node.get_closest_marker("internal_errors") is not None
    if INTERNAL_ERRORS.records and not planted:
        pytest.fail(f"The program met an internal error.\n{INTERNAL_ERRORS}", pytrace=False)
