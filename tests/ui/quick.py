"""Shortcuts for panels in tests: no repeated parsing, no unseen drawing, no needless waking."""

from __future__ import annotations

import asyncio
from typing import Any

from rich.console import RenderableType
from textual._compositor import Compositor
from textual._context import active_app
from textual.css.stylesheet import Stylesheet
from textual.message_pump import MessagePump
from textual.pilot import Pilot
from textual.screen import Screen

_draw = Compositor.render_update
_parse = Stylesheet._parse_rules
_parsed: dict[object, Any] = {}


def parse_once(sheet: Stylesheet, *source: Any, **how: Any) -> Any:
    """The rules of a source, parsed once for each theme and all panels."""
    key = (source, tuple(how.items()), tuple(sheet._variables.items()))
    if key not in _parsed:
        _parsed[key] = _parse(sheet, *source, **how)
    return _parsed[key]


def drawn_for_a_person(
    self: Compositor,
    full: bool = False,
    screen_stack: list[Screen[Any]] | None = None,
    simplify: bool = False,
) -> RenderableType | None:
    """Draw whole pictures only: without a terminal Textual discards all others."""
    if full or not active_app.get().is_headless:
        return _draw(self, full, screen_stack, simplify)
    self._dirty_regions.clear()
    return None


async def wait_for_the_busy(self: Pilot[Any], timeout: float = 30.0) -> bool:
    """Wait until the queue of the screen is done; return False if an error comes first.

    The pilot's own method wakes every widget, also those that wait for a message. That is a tenth
    of a panel's work in a test.
    """
    app = self.app
    if not app.screen_stack:
        return False
    done = asyncio.Event()
    left = 0

    def one_less() -> None:
        nonlocal left
        left -= 1
        if not left:
            done.set()

    for pump in (app, app.screen, *filter(is_busy, app.screen.walk_children())):
        left += pump.call_later(one_less)
    if left:
        waiting = {asyncio.ensure_future(event.wait()) for event in (done, app._exception_event)}
        ended, others = await asyncio.wait(
            waiting, timeout=timeout, return_when=asyncio.FIRST_COMPLETED
        )
        for other in others:
            other.cancel()
        assert ended, "the widgets of the screen did not do what is queued"
    return left == 0


def is_busy(pump: MessagePump) -> bool:
    """True if it has or handles a message, so that it does not wait for one."""
    ready: asyncio.Event = pump._message_queue.ready_event
    return ready.is_set() or not ready._waiters
