"""Publication of values of lines, from the first cycle to the last message; metrics by HTTP."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable, Collection, Iterable, Iterator, Sequence
from contextlib import asynccontextmanager, suppress
from http import HTTPStatus
from socket import gethostname
from typing import TYPE_CHECKING

import tui
from tui.bus.gateway.room import ServedConnection, host_of, makes_room

from ..shared.errors import LINE_TROUBLE, Failure
from ..shared.options import why_not_served, written_host_port
from .broker import Broker
from .drives import PlantLine
from .metrics import METRICS_TYPE, metrics_text
from .publish_options import warn_of_plain_password, warn_of_strangers
from .status import LineReport

if TYPE_CHECKING:
    from .mqtt import MqttPublisher


log = logging.getLogger(__name__)

PATH = "/metrics"
LONGEST_REQUEST = 8192
ANSWERED_WITHIN = 10.0
"""Most seconds for a request and its reply; then the client is disconnected."""
MOST_SCRAPES = 16
"""Most connections; one more closes the oldest of the host with the most connections."""


class MetricsServer:
    """Answers GET /metrics until it is closed; for one loop."""

    def __init__(self, text: Callable[[], str]) -> None:
        self._text = text
        self._server: asyncio.Server | None = None
        self._tasks: dict[asyncio.Task[None], tuple[str, float]] = {}
        """Host and time of each connection."""
        self._names: frozenset[str] = frozenset()
        """Host names accepted in requests, in addition to the address of each connection."""

    async def listen(self, host: str, port: int) -> tuple[str, int]:
        """Listen at an address; return it, with the real port for port 0. Raises OSError."""
        own = gethostname().casefold()
        self._names = frozenset({host.casefold(), own, f"{own}.local", "localhost"})
        self._server = await asyncio.start_server(self._serve, host, port, limit=LONGEST_REQUEST)
        found = self._server.sockets[0].getsockname()
        return found[0], found[1]

    async def close(self) -> None:
        """Accept no more connections, and end the present ones."""
        if self._server is not None:
            self._server.close()
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        now, host = asyncio.get_running_loop().time(), host_of(writer.get_extra_info("peername"))
        if len(self._tasks) >= MOST_SCRAPES:
            here = {
                item: ServedConnection(its, now - since)
                for item, (its, since) in self._tasks.items()
            }
            oldest = makes_room(host, here)
            del self._tasks[oldest]
            oldest.cancel()
        self._tasks[task] = host, now
        try:
            async with asyncio.timeout(ANSWERED_WITHIN):
                head = await reader.readuntil(b"\r\n\r\n")
                own = host_of(writer.get_extra_info("sockname")).casefold()
                writer.write(self._answer(head, self._names | {own}))
                await writer.drain()
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError) as error:
            log.info("a client of the metrics was disconnected: %s", error or "too slow")
        except asyncio.CancelledError:
            # closing the server is not an error of this connection
            return
        finally:
            self._tasks.pop(task, None)
            with suppress(OSError, RuntimeError):
                writer.close()

    def _answer(self, head: bytes, names: Collection[str]) -> bytes:
        """Return headers and body for a request to a server with these names."""
        first, *headers = head.decode("latin-1").split("\r\n")
        method, _, rest = first.partition(" ")
        path = rest.partition(" ")[0].partition("?")[0]
        # a web page may send requests from this computer under its own name (DNS rebinding)
        if any(host not in names for host in _hosts(headers)):
            return _http(HTTPStatus.MISDIRECTED_REQUEST, "Use the address of this host.\n")
        if method not in ("GET", "HEAD"):
            return _http(HTTPStatus.METHOD_NOT_ALLOWED, "Use GET or HEAD.\n")
        if path != PATH:
            return _http(HTTPStatus.NOT_FOUND, f"The metrics are at {PATH}.\n")
        try:
            text = self._text()
        except Exception:
            # one unexpected error must not end the service
            log.exception("the metrics were not served")
            return _http(HTTPStatus.INTERNAL_SERVER_ERROR, "Internal error. See the log.\n")
        return _http(HTTPStatus.OK, text, METRICS_TYPE, body=method == "GET")


def _hosts(headers: Iterable[str]) -> Iterator[str]:
    """Yield the hosts in a request, without ports, in small letters."""
    for header in headers:
        name, _, value = header.partition(":")
        if name.strip().casefold() == "host":
            host = value.strip().casefold()
            bracketed = host.startswith("[")
            yield host[1:].partition("]")[0] if bracketed else host.partition(":")[0].rstrip(".")


def _http(
    status: HTTPStatus, text: str, kind: str = "text/plain; charset=utf-8", *, body: bool = True
) -> bytes:
    """Return a whole reply; the connection ends with it."""
    content = text.encode("utf-8", "replace")
    head = (
        f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: {kind}\r\n"
        f"Content-Length: {len(content)}\r\nConnection: close\r\n\r\n"
    )
    return head.encode() + (content if body else b"")


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
