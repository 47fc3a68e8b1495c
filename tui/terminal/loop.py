"""The event loop of the app, for callers in another thread.

Textual's `call_from_thread` waits until the loop has done the work. A stop key must not wait.
"""

from __future__ import annotations

from collections.abc import Callable

from textual.app import App


def soon_in_loop(app: App[None], work: Callable[..., object], *given: object) -> None:
    """Run `work` in an app's loop without waiting for it; do nothing if no loop runs."""
    loop = app._loop
    if loop is not None and loop.is_running():
        loop.call_soon_threadsafe(lambda: work(*given))
