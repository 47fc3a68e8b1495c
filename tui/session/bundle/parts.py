"""Parts of a bundle: each is collected alone, within a time limit; a failure ends no other."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

log = logging.getLogger(__name__)

T = TypeVar("T")
Content = str | bytes | dict[str, Any] | list[Any]
"""A text, the bytes of a file, or a JSON document."""
PartProgress = Callable[[int, int, str], None]
"""Called with the number of finished parts, of all parts, and the name of the current one."""


class Missing(Exception):
    """A part cannot be collected; the text is the reason for a person."""


@dataclass(frozen=True, slots=True)
class PartFile:
    """One file of the bundle."""

    content: Content
    note: str = ""
    """Missing contents, as a sentence; empty if it is complete."""
    more: Mapping[str, Content] = field(default_factory=dict)
    """Further files in the same folder, by name."""


@dataclass(frozen=True, slots=True)
class Part:
    """One file of a bundle, and how to collect it."""

    name: str
    """Its name in the bundle, with forward slashes."""
    about: str
    """Contents, as a sentence."""
    collect: Callable[[], Awaitable[PartFile]]
    limit: float = 10.0
    """Seconds."""


@dataclass(frozen=True, slots=True)
class PartResult:
    """Result of a collected part, or the reason for its absence."""

    part: Part
    file: PartFile | None
    missing: str = ""


async def collect_parts(
    parts: Sequence[Part], progress: PartProgress | None = None
) -> list[PartResult]:
    """Collect the parts one after the other; raises nothing but a cancellation."""
    results = []
    for number, part in enumerate(parts):
        if progress is not None:
            progress(number, len(parts), part.name)
        results.append(await _collected(part))
    if progress is not None:
        progress(len(parts), len(parts), "")
    return results


async def _collected(part: Part) -> PartResult:
    try:
        async with asyncio.timeout(part.limit):
            return PartResult(part, await part.collect())
    except TimeoutError:
        return PartResult(part, None, f"It took longer than {part.limit:g} s.")
    except Missing as error:
        return PartResult(part, None, str(error))
    except Exception as error:
        # after a failure of any kind, the other parts matter even more
        log.info("a part of a bundle failed: %s", part.name, exc_info=True)
        return PartResult(part, None, str(error) or type(error).__name__)


async def in_own_thread(work: Callable[[], T]) -> T:
    """Run blocking work in a daemon thread, so that a hanging disk does not delay the exit."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[T] = loop.create_future()

    def settle(error: Exception | None, result: T | None) -> None:
        if answer.cancelled():
            return
        if error is not None:
            answer.set_exception(error)
        else:
            answer.set_result(result)  # type: ignore[arg-type]

    def run() -> None:
        error, result = None, None
        try:
            result = work()
        except Exception as raised:
            error = raised
        try:
            loop.call_soon_threadsafe(settle, error, result)
        except RuntimeError:
            log.info("work for a bundle ended after its program")

    threading.Thread(target=run, name="bundle", daemon=True).start()
    return await answer
