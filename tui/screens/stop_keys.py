"""Stop keys, taken where the keys come in: before the screen, and while the screen is stuck.

Textual hands keys to its event loop, which waits for the terminal whenever that takes no more
bytes. The thread that reads the keys does not: there the stop keys are recognised.
"""

from __future__ import annotations

import codecs
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Protocol, cast

from textual import events
from textual.driver import Driver
from textual.message import Message

STOP_ANYWHERE = "f12"
STOP_ALL_ANYWHERE = "f9"
STOP_OUTSIDE_TEXT = "space"


class Stops(Protocol):
    """What the app does with a stop key; called in the thread that reads the keys."""

    def take_stop_key(self, key: str) -> bool:
        """Stop, if the key means that now; True if it was taken."""


@lru_cache(maxsize=1)
def with_stop_keys(driver: type[Driver]) -> type[Driver]:
    """The driver of this platform, giving stop keys away before anything else."""
    _tolerate_bad_bytes()

    class StopDriver(driver):  # type: ignore[valid-type, misc]
        """Gives stop keys to the app in the thread that reads them."""

        def process_message(self, message: Message) -> None:
            if isinstance(message, events.Key):
                app = cast("Stops", self._app)
                if app.take_stop_key(message.key):
                    return
            super().process_message(message)

    return StopDriver


def _tolerate_bad_bytes() -> None:
    """A byte from the terminal that is no text must not end the thread that reads the keys."""
    try:
        from textual.drivers import linux_driver
    except ImportError:
        return
    strict: Callable[..., Any] = codecs.getincrementaldecoder

    def tolerant(encoding: str) -> Callable[[], codecs.IncrementalDecoder]:
        return lambda: strict(encoding)(errors="replace")

    vars(linux_driver)["getincrementaldecoder"] = tolerant
