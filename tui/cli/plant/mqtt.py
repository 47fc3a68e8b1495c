"""Publication to a broker: retained messages, a last will, all repeated after each connection.

No topic is subscribed to, and messages of a broker are discarded: none of them reaches a drive.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import re
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from ..shared.say import say
from .broker import Broker
from .status import LineReport
from .topics import OFFLINE, ONLINE, drive_messages, line_messages, status_topic

if TYPE_CHECKING:
    import aiomqtt

log = logging.getLogger(__name__)
_client_log = logging.getLogger(f"{__name__}.client")
# it logs every unrequested message of a broker; real errors are raised
_client_log.setLevel(logging.CRITICAL)

MQTT_KEEPALIVE = 10
"""Seconds; a broker sends the last will after 1.5 of these at the latest."""
TRY_AGAIN_FIRST, TRY_AGAIN_LONGEST = 1.0, 30.0
"""Seconds from a lost connection to the next attempt; each failed one doubles them."""
LINES_EVERY = 10.0
"""Seconds between two messages about an unchanged line; the status is sent with them."""
LOOKED_EVERY = 2.0
"""Seconds after which values are checked even without new ones, because they may be too old."""
LAST_WORD_WITHIN = 3.0

Sights = Callable[[], Sequence[LineReport]]


class MqttPublisher:
    """Publishes lines and drives to a broker; for one loop."""

    def __init__(self, broker: Broker, sights: Sights) -> None:
        self._broker = broker
        self._sights = sights
        self._news = asyncio.Event()
        self._ended = False
        self._trouble = ""
        self.connected = False
        """True while a broker is connected."""

    def news(self) -> None:
        """Note that a value was read, or that the state of a line has changed."""
        self._news.set()

    def end(self) -> None:
        """Publish `offline` and end; run() returns."""
        self._ended = True
        self._news.set()

    async def run(self) -> None:
        """Publish until end(); a lost or missing broker is retried."""
        delay, loop = TRY_AGAIN_FIRST, asyncio.get_running_loop()
        while not self._ended:
            begun = loop.time()
            try:
                await self._connected()
            except Exception as error:
                if not _is_mqtt(error):
                    log.exception("publishing failed")
                self._lost(why_lost(error))
            # two programs with the same topic disconnect each other at once: wait before the next
            # attempt
            lasted = loop.time() - begun > TRY_AGAIN_LONGEST
            delay = TRY_AGAIN_FIRST if lasted else min(2 * delay, TRY_AGAIN_LONGEST)
            await self._wait_to_try(delay)

    async def _wait_to_try(self, seconds: float) -> None:
        loop = asyncio.get_running_loop()
        end = loop.time() + seconds
        while not self._ended and (left := end - loop.time()) > 0:
            self._news.clear()
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), left)

    async def _connected(self) -> None:
        """Handle one connection, from its start until it is lost or end() is called."""
        async with self._client() as client:
            self.connected = True
            if self._trouble:
                say(f"drivepanel: {self._broker.place} is connected again.", err=True)
                self._trouble = ""
            lost = asyncio.create_task(_until_lost(client))
            lost.add_done_callback(lambda _: self._news.set())
            try:
                await self._publish(client, lost)
            finally:
                if not lost.done():
                    await self._status(client, OFFLINE, timeout=LAST_WORD_WITHIN)
                self.connected = False
                lost.cancel()
                await asyncio.gather(lost, return_exceptions=True)

    def _client(self) -> aiomqtt.Client:
        import ssl

        import aiomqtt

        broker, will = self._broker, status_topic(self._broker.root)
        return aiomqtt.Client(
            broker.host,
            broker.port,
            username=broker.user,
            password=broker.password,
            identifier=client_id(broker.root),
            logger=_client_log,
            will=aiomqtt.Will(will, OFFLINE, qos=1, retain=True),
            keepalive=MQTT_KEEPALIVE,
            tls_context=ssl.create_default_context() if broker.tls else None,
            max_queued_incoming_messages=1,
        )

    async def _publish(self, client: aiomqtt.Client, lost: asyncio.Task[None]) -> None:
        """Publish changed values. Raises the error that ended the connection."""
        sent: dict[str, str] = {}
        loop = asyncio.get_running_loop()
        reported = float("-inf")
        states: list[object] = []
        while not self._ended and not lost.done():
            self._news.clear()
            sights = self._sights()
            seen: list[object] = [(sight.state.status, sight.state.reason) for sight in sights]
            if states != seen or loop.time() - reported > LINES_EVERY:
                states, reported = seen, loop.time()
                await self._status(client, ONLINE)
                await _send(client, line_messages(self._broker.root, sights), sent)
            await _send(client, drive_messages(self._broker.root, sights), sent)
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), LOOKED_EVERY)
        if lost.done():
            lost.result()

    async def _status(
        self, client: aiomqtt.Client, status: str, timeout: float | None = None
    ) -> None:
        # the broker acknowledges this after it has received everything before it
        await client.publish(
            status_topic(self._broker.root), status, qos=1, retain=True, timeout=timeout
        )

    def _lost(self, why: str) -> None:
        """Report once that the broker is not connected, with the reason."""
        if not self._trouble:
            say(
                f"drivepanel: {self._broker.place}: {why or 'the connection is lost'}. Retrying.",
                err=True,
            )
        self._trouble = why or "lost"


async def _until_lost(client: aiomqtt.Client) -> None:
    """Discard all messages; raises when the connection is lost."""
    async for _ in client.messages:
        pass


async def _send(client: aiomqtt.Client, messages: Mapping[str, str], sent: dict[str, str]) -> None:
    for topic, text in messages.items():
        if sent.get(topic) != text:
            await client.publish(topic, text, retain=True)
            sent[topic] = text


def client_id(root: str) -> str:
    """Return a client id that is the same for each run with this topic.

    So a broker ends a remaining connection of the previous run, with its last will, before it
    accepts this one.
    """
    text = f"{socket.gethostname()} {root}"
    return f"drivepanel-{hashlib.sha256(text.encode()).hexdigest()[:10]}"


def why_lost(error: Exception) -> str:
    """Return the cause of a lost connection: the system's words without their number."""
    return re.sub(r"^\[(Errno|SSL)[^]]*\] ", "", str(error))


def _is_mqtt(error: Exception) -> bool:
    import aiomqtt

    return isinstance(error, aiomqtt.MqttError | OSError)
