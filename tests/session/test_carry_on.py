"""Steps of a stop: an internal error in one of them ends no stop, a closed line does."""

from __future__ import annotations

import logging
from collections.abc import Callable

import pytest

from tui.bus.errors import LineClosed
from tui.session import carry_on
from tui.session.carry_on import carried_on


def test_closed_line_is_raised() -> None:
    with pytest.raises(LineClosed):
        carried_on(raising(LineClosed()))


@pytest.mark.internal_errors
def test_internal_error_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    carried_on(raising(ZeroDivisionError("an error of ours")))
    (record,) = caplog.records
    assert "an internal error on the way of a stop" in record.message
    assert record.exc_info is not None
    assert isinstance(record.exc_info[1], ZeroDivisionError)


def test_failing_log_does_not_end_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(carry_on, "log", FailingLog("tests"))
    carried_on(raising(ZeroDivisionError()))


class FailingLog(logging.Logger):
    def exception(self, *_: object, **__: object) -> None:
        raise OSError("no space left")


def raising(error: Exception) -> Callable[[], None]:
    def step() -> None:
        raise error

    return step
