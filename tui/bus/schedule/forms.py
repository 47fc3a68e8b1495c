"""Reads that are sent longer than needed, so that no earlier reply can be mistaken for theirs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..limits import Limits, send_refusal
from ..requests import Read
from ..result import ExchangeResult, ResultKind

MOST_MORE = 8
"""Registers that are read in addition at most."""
FORM_TRIES = 2
"""Longer reads in a row without a reply after which that length is not sent again."""
REMEMBERED = 4096
"""Longer reads whose failures are remembered at most."""


class Forms:
    """Lengths that a drive replies to; lives in the line's loop.

    A reply names no request, but its length is that of its own request. A drive may refuse a
    longer read: the register after those needed need not exist.
    """

    def __init__(self) -> None:
        self._failures: dict[Read, int] = {}

    def longer(self, request: Read, limits: Limits) -> Iterator[Read]:
        """Reads of more registers from the same one on, shortest first; some may meet silence."""
        for more in range(1, MOST_MORE + 1):
            form = replace(request, count=request.count + more)
            if self._failures.get(form, 0) > FORM_TRIES:
                return  # refused: what is longer is refused too
            if not send_refusal(form, limits) and self._failures.get(form, 0) < FORM_TRIES:
                yield form

    def note(self, form: Read, result: ExchangeResult) -> None:
        """Note the end of a longer read."""
        if result.kind is ResultKind.REPLY:
            self._failures.pop(form, None)
            return
        if len(self._failures) >= REMEMBERED:
            self._failures.clear()
        refused = result.kind is ResultKind.EXCEPTION
        self._failures[form] = FORM_TRIES + 1 if refused else self._failures.get(form, 0) + 1


def shorter(request: Read, limits: Limits) -> Iterator[Read]:
    """Reads of fewer registers from the same one on, longest first."""
    for count in range(request.count - 1, 0, -1):
        form = replace(request, count=count)
        if not send_refusal(form, limits):
            yield form
