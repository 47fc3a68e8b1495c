"""Reads that are sent longer than needed, so that no earlier reply can be mistaken for theirs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..limits import Limits, send_refusal
from ..master import ExchangeResult, MonotonicClock, ResultKind
from ..requests import Read

MOST_MORE = 8
"""Registers that are read in addition at most."""
FORM_TRIES = 2
"""Longer reads in a row without a reply after which none so long is sent for a while."""
SILENT_FOR, DEVICE_SILENT_FOR = 60.0, 300.0
"""Seconds until they are sent again: of those registers, and to a drive that may be silent."""
REMEMBERED = 4096
"""Longer reads whose failures are remembered at most."""


class Forms:
    """Lengths that a drive replies to; lives in the line's loop.

    A reply names no request, but its length is that of its own request. A drive may refuse a
    longer read, or be silent: the register after those needed need not exist.
    """

    def __init__(self, clock: MonotonicClock) -> None:
        self._clock = clock
        self._refused: set[Read] = set()
        self._silences: dict[Read | int, tuple[int, float]] = {}
        """Silences in a row, and when the last was; by read, and by device for reads that it may
        always meet with silence."""

    def longer(self, request: Read, limits: Limits) -> Iterator[Read]:
        """Reads of more registers from the same one on, shortest first; some may meet silence."""
        for more in range(1, MOST_MORE + 1):
            form = replace(request, count=request.count + more)
            if form in self._refused or self._rests(form, SILENT_FOR):
                return  # what is longer is refused too
            if not send_refusal(form, limits):
                yield form

    def may_be_longer(self, device: int) -> bool:
        """False while a drive does not answer longer reads."""
        return not self._rests(device, DEVICE_SILENT_FOR)

    def _rests(self, which: Read | int, seconds: float) -> bool:
        times, last = self._silences.get(which, (0, 0.0))
        if times and self._clock() - last > seconds:
            del self._silences[which]
            return False
        return times >= FORM_TRIES

    def note(self, form: Read, result: ExchangeResult) -> None:
        """Note the end of a longer read."""
        if result.kind is ResultKind.REPLY:
            self._silences.pop(form, None)
            self._silences.pop(form.device, None)
            return
        if len(self._silences) + len(self._refused) >= REMEMBERED:
            self._silences.clear()
            self._refused.clear()
        if result.kind is ResultKind.EXCEPTION:
            self._refused.add(form)
        else:
            self._note_silence(form)

    def note_device(self, device: int) -> None:
        """A drive was silent to a longer read, and then answered what it was sent for."""
        self._note_silence(device)

    def _note_silence(self, which: Read | int) -> None:
        self._silences[which] = self._silences.get(which, (0, 0.0))[0] + 1, self._clock()


def shorter(request: Read, limits: Limits) -> Iterator[Read]:
    """Reads of fewer registers from the same one on, longest first."""
    for count in range(request.count - 1, 0, -1):
        form = replace(request, count=count)
        if not send_refusal(form, limits):
            yield form
