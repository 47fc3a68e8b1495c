"""Commands of several words that end before the last one: their stop is followed to standstill."""

from __future__ import annotations

import asyncio
import importlib
from typing import Any

import pytest

from tests.session.test_sequences import primed
from tui.cli.running import stop_following
from tui.cli.running.stop_following import carried_to_rest
from tui.cli.shared.errors import DRIVE_REFUSED, LINE_TROUBLE, Failure
from tui.session.command.stop_report import Phase, StopReport
from tui.session.fleet import HALF_SENT, Fleet

from .commands import ended

FAILED = StopReport(1, Phase.FAILED, "NOT STOPPED: it did not answer.", 0.0, 0.0)


@pytest.mark.parametrize(
    ("report", "text", "status"),
    [
        (None, "Device 1: stopped.", DRIVE_REFUSED),
        (FAILED, "Device 1: NOT STOPPED: it did not answer.", LINE_TROUBLE),
    ],
)
async def test_half_of_a_command_is_followed_to_standstill(
    report: StopReport | None, text: str, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def returned(*_: Any) -> Any:
        return report

    async def silent(*_: Any) -> int:
        return LINE_TROUBLE

    if report is not None:
        monkeypatch.setattr(stop_following, "ended", returned)
    monkeypatch.setattr(stop_following, "status_of_failed", silent)
    async with primed('{ states = ["primed"], ms = 300 }') as made:
        fleet = Fleet(made.line, made.console.journal, clock=made.clock)
        fleet.take(made.session)
        made.drive.set("STAT", 1)
        causes: list[str] = []
        stop = fleet.stop

        def stopped(sessions: Any, *, by: str = "") -> Any:
            causes.append(by)
            return stop(sessions, by=by)

        monkeypatch.setattr(fleet, "stop", stopped)

        def give() -> None:
            made.commander.run("forward", "20Hz")

        given = asyncio.create_task(carried_to_rest(fleet, made.console, give))
        await made.let_go_until(given.done)
        with pytest.raises(Failure) as failed:
            await given
        first, last = failed.value.message.splitlines()
        assert "ended after word 1 of 2" in first
        assert last == text
        assert failed.value.status == status
        assert HALF_SENT in causes


@pytest.mark.parametrize("words", [("reference", "30Hz"), ("reset",)], ids=lambda words: words[0])
def test_command_follows_half_of_itself(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    async def half(*_: Any) -> Any:
        raise Failure("Half of it was sent.\nDevice 1: stopped.", DRIVE_REFUSED)

    module = importlib.import_module("tui.cli.commands.single_orders")
    monkeypatch.setattr(module, "carried_to_rest", half)
    done = ended(DRIVE_REFUSED, words[0], "sim:atv71", *words[1:], "--arm")
    assert "Device 1: stopped." in done.stderr
