"""Publication of values of lines, from the first cycle to the last message."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import tui

from ..shared.errors import LINE_TROUBLE, Failure
from ..shared.host_port import why_not_served, written_host_port
from .broker import Broker
from .drives import PlantLine
from .metrics import metrics_text
from .metrics_server import PATH, MetricsServer
from .publish_options import warn_of_plain_password, warn_of_strangers
from .status import LineReport

if TYPE_CHECKING:
    from collections.abc import Callable

    from .mqtt import MqttPublisher


class Changes:
    """Notifies one listener of new values; set once it exists."""

    def __init__(self) -> None:
        self.listener: Callable[[], None] = lambda: None

    def __call__(self) -> None:
        self.listener()


def sights_of(lines: Sequence[PlantLine]) -> list[LineReport]:
    """Return the current state of each line."""
    now = time.monotonic()
    return [line.sight(now) for line in lines]


@asynccontextmanager
async def reading(lines: Sequence[PlantLine]) -> AsyncIterator[None]:
    """Read the drives of the lines while inside; an unexpected error ends it."""
    async with asyncio.TaskGroup() as tasks:
        running = [tasks.create_task(line.run(), name=f"plant {line.name}") for line in lines]
        try:
            yield
        finally:
            for task in running:
                task.cancel()


@asynccontextmanager
async def metrics_at(lines: Sequence[PlantLine], host: str, port: int) -> AsyncIterator[str]:
    """Serve metrics while inside; yield their URL. Raises Failure if they cannot be served."""
    server = MetricsServer(
        lambda: metrics_text(sights_of(lines), tui.__version__, time.monotonic())
    )
    try:
        host, port = await server.listen(host, port)
    except OSError as error:
        place, why = written_host_port(host, port), why_not_served(error)
        raise Failure(f"Metrics cannot be served at {place}: {why}.", LINE_TROUBLE) from error
    warn_of_strangers(host, port)
    try:
        yield f"http://{written_host_port(host, port)}{PATH}"
    finally:
        await server.close()


@asynccontextmanager
async def published_to(
    lines: Sequence[PlantLine], broker: Broker, changes: Changes
) -> AsyncIterator[str]:
    """Publish to a broker while inside; yields the place as text."""
    from .mqtt import LAST_WORD_WITHIN, MqttPublisher

    warn_of_plain_password(broker)
    publisher: MqttPublisher = MqttPublisher(broker, lambda: sights_of(lines))
    changes.listener = publisher.news
    task = asyncio.create_task(publisher.run(), name="mqtt")
    try:
        yield f"{broker.place}/{broker.root}"
    finally:
        publisher.end()
        if not publisher.connected:
            task.cancel()
        _, late = await asyncio.wait({task}, timeout=2 * LAST_WORD_WITHIN)
        for item in late:
            item.cancel()
