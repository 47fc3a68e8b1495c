"""Wait of a command on a line of 1200 baud that a panel uses too."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.link import Link, SerialLink, TcpLink
from tui.drive.profile import library
from tui.session.clock import patience
from tui.session.fleet import Fleet
from tui.session.running.watching import learned_timeout
from tui.session.timeout_report import TimeoutWatch


def line_to(link: Link) -> Any:
    return SimpleNamespace(link=link)


def test_patience_is_longer_on_a_slow_line() -> None:
    waits = [patience(line_to(SerialLink("x", baud, "8E1")), 3.0) for baud in (19200, 9600, 1200)]
    assert [round(wait, 1) for wait in waits] == [3.7, 4.4, 14.0]
    assert patience(line_to(TcpLink("host")), 3.0) == 3.0


async def test_timeout_learned_late_does_not_fail_status(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beside a panel at 1200 baud, status ended with "TTO is set and could not be learnt"."""
    monkeypatch.setattr("tui.session.running.watching.LEARNT_WITHIN", 0.0)
    session = SimpleNamespace(
        profile=library.load("atv71"), line=line_to(SerialLink("x", 1200, "8E1"))
    )
    watch, looks = TimeoutWatch(10.0, None), iter([[session]] * 4)
    line_watch = SimpleNamespace(unread=lambda: next(looks, []), watch=lambda _: watch)
    console: Any = SimpleNamespace(session=session, device=1)
    assert (
        await learned_timeout(cast("Fleet", SimpleNamespace(line_watch=line_watch)), console)
        is watch
    )
