"""Outcome of a command that a program waits for, by a queue whose work takes a few looks."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from tui.bus.errors import LineLost
from tui.drive.errors import DriveError
from tui.drive.orders import OrderRefused
from tui.session.running import watching
from tui.session.running.watching import outcome_of, outcome_or_error
from tui.session.work import Outcome, OutcomeKind

BEFORE = Outcome(OutcomeKind.REFUSED, "It is of the command before.", 0.5)
WORKING = Outcome(OutcomeKind.WORKING, "on the way", 1.0)
DONE = Outcome(OutcomeKind.DONE, "It runs.", 2.0)
LOST, UNARMED = LineLost("The line is lost."), OrderRefused("Not armed.")


class Queue:
    """Work with one outcome for each look; it is busy until the last one."""

    def __init__(self, *outcomes: Outcome, ended: int = 0) -> None:
        self.looks: list[Outcome | None] = [BEFORE, *outcomes]
        self.left = len(outcomes) - ended
        self.of: list[object] = []

    @property
    def outcome(self) -> Outcome | None:
        return self.looks[0]

    def busy_for(self, owner: object) -> bool:
        self.of.append(owner)
        if len(self.looks) > 1:
            self.looks.pop(0)
        self.left -= 1
        return self.left >= 0


def commander(queue: Queue) -> Any:
    return SimpleNamespace(session=SimpleNamespace(work=queue))


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watching, "COMMAND_POLL_INTERVAL", 0.0)


@pytest.mark.parametrize(
    ("queue", "found", "looks"),
    [
        (Queue(WORKING, WORKING, DONE, BEFORE), DONE, 4),
        (Queue(DONE, ended=1), DONE, 1),
        (Queue(WORKING, DONE, ended=2), WORKING, 1),
        (Queue(BEFORE, ended=1), None, 1),
        (Queue(WORKING, BEFORE, ended=1), None, 2),
    ],
)
async def test_outcome_of_a_command_is_the_first_final_one_of_its_own(
    queue: Queue, found: Outcome | None, looks: int
) -> None:
    given: list[bool] = []
    owner = commander(queue)
    assert await outcome_of(owner, lambda: given.append(True)) is found
    assert given == [True]
    assert queue.of == [owner] * looks


def refused(text: str, error: Exception | None) -> Queue:
    return Queue(Outcome(OutcomeKind.REFUSED, text, 1.0, error), ended=1)


@pytest.mark.parametrize(
    ("queue", "kind", "text"),
    [
        (Queue(BEFORE, ended=1), OrderRefused, "Not sent: superseded by a newer command."),
        (refused("The line is lost.", LOST), LineLost, "The line is lost."),
        (refused("It says more.", UNARMED), OrderRefused, "Not armed."),
        (refused("An internal error.", KeyError("x")), DriveError, "An internal error."),
        (refused("No.", None), DriveError, "No."),
    ],
)
async def test_command_without_success_raises_its_error(
    queue: Queue, kind: type[Exception], text: str
) -> None:
    with pytest.raises(Exception) as caught:  # noqa: PT011 - its exact type is compared
        await outcome_or_error(commander(queue), lambda: None)
    assert (type(caught.value), str(caught.value)) == (kind, text)


async def test_command_that_succeeds_has_its_outcome() -> None:
    found = await outcome_or_error(commander(Queue(DONE, ended=1)), lambda: None)
    assert found is DONE
