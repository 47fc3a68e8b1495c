"""The metrics by HTTP, for Prometheus and whoever asks as it does."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus

from .metrics import METRICS_TYPE

log = logging.getLogger(__name__)

PATH = "/metrics"
LONGEST_REQUEST = 8192
ANSWERED_WITHIN = 10.0
"""Seconds in which a client has asked and taken its answer; then it is let go."""
MOST_SCRAPES = 16
"""Connections at a time; one more is closed at once."""


class MetricsServer:
    """Answers GET /metrics until it is closed; lives in one loop."""

    def __init__(self, text: Callable[[], str]) -> None:
        self._text = text
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()

    async def listen(self, host: str, port: int) -> tuple[str, int]:
        """Listen at an address; returns it with the port that was found for 0. Raises OSError."""
        self._server = await asyncio.start_server(self._serve, host, port, limit=LONGEST_REQUEST)
        found = self._server.sockets[0].getsockname()
        return found[0], found[1]

    async def close(self) -> None:
        """Take no more connections, and end those that are."""
        if self._server is not None:
            self._server.close()
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        if len(self._tasks) >= MOST_SCRAPES:
            writer.close()
            return
        self._tasks.add(task)
        try:
            async with asyncio.timeout(ANSWERED_WITHIN):
                head = await reader.readuntil(b"\r\n\r\n")
                writer.write(self._answer(head))
                await writer.drain()
        except (OSError, EOFError, TimeoutError, asyncio.LimitOverrunError) as error:
            log.info("who asked for metrics was let go: %s", error or "too slow")
        except asyncio.CancelledError:
            # closing the server is no error of this connection
            return
        finally:
            self._tasks.discard(task)
            with suppress(OSError, RuntimeError):
                writer.close()

    def _answer(self, head: bytes) -> bytes:
        """Headers and body for a request."""
        method, _, rest = head.partition(b"\r\n")[0].decode("latin-1").partition(" ")
        path = rest.partition(" ")[0].partition("?")[0]
        if method not in ("GET", "HEAD"):
            return _http(HTTPStatus.METHOD_NOT_ALLOWED, "Nothing is taken here.\n")
        if path != PATH:
            return _http(HTTPStatus.NOT_FOUND, f"The metrics are at {PATH}.\n")
        try:
            text = self._text()
        except Exception:
            # one answer that nobody foresaw ends no service
            log.exception("the metrics were not told")
            return _http(HTTPStatus.INTERNAL_SERVER_ERROR, "The log says what is wrong.\n")
        return _http(HTTPStatus.OK, text, METRICS_TYPE, body=method == "GET")


def _http(
    status: HTTPStatus, text: str, kind: str = "text/plain; charset=utf-8", *, body: bool = True
) -> bytes:
    """A whole answer; the connection ends with it."""
    content = text.encode("utf-8", "replace")
    head = (
        f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: {kind}\r\n"
        f"Content-Length: {len(content)}\r\nConnection: close\r\n\r\n"
    )
    return head.encode() + (content if body else b"")
