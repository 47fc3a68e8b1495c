"""Words of the last replies, for reads of other programs while they are recent."""

from __future__ import annotations

from collections.abc import Sequence

from ..model import Reply
from ..requests import BROADCAST, Read, Request


class SharedValues:
    """The words of the last replies by device, function and register; used in the line's loop."""

    def __init__(self) -> None:
        self._words: dict[int, dict[tuple[int, int], tuple[int, float]]] = {}

    def note(self, request: Request, words: Sequence[int], time: float) -> None:
        """Keep the words of a read; a change of a device discards all of its words."""
        if request.changes:
            self.drop(request.device)
        elif isinstance(request, Read):
            kept = self._words.setdefault(request.device, {})
            for offset, word in enumerate(words):
                kept[request.function, request.address + offset] = word, time

    def drop(self, device: int) -> None:
        """Forget the words of a device, of all for a broadcast: they may have changed."""
        if device == BROADCAST:
            self._words.clear()
        else:
            self._words.pop(device, None)

    def find(self, request: Request, oldest: float) -> Reply | None:
        """The reply to a read, made of words that were read no earlier than `oldest`.

        Only of words of one reply: two of different times could belong to two values.
        """
        if not isinstance(request, Read):
            return None
        kept = self._words.get(request.device, {})
        first = kept.get((request.function, request.address))
        if first is None or first[1] < oldest:
            return None
        words = []
        for register in range(request.address, request.address + request.count):
            word = kept.get((request.function, register))
            if word is None or word[1] != first[1]:
                return None
            words.append(word[0])
        return Reply(tuple(words), first[1], request.pdu_of(words))
