"""Makes room for a further connection to a server with a limited number.

Each address of clients has a share: the one with the most connections loses one of its own. So no
number of connections excludes a client that must stop a motor. A connection that waits for the
answer to a write is closed last: the write may be a stop. It is carried out, but not answered.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

K = TypeVar("K")


@dataclass(frozen=True, slots=True)
class ServedConnection:
    """A connection that is served."""

    address: str
    """The host that it comes from."""
    idle: float
    """Seconds since its last request or its start; 0 while a read waits for its answer."""
    writes: bool = False
    """True while a write of it is not answered yet."""


def makes_room(address: str, here: Mapping[K, ServedConnection]) -> K:
    """The connection to close for a further one from an address.

    Of the address that would have the most connections, it is the one idle for longest.
    """
    counts = Counter(connection.address for connection in here.values())
    counts[address] += 1
    most = max(counts[connection.address] for connection in here.values())
    busiest = {
        key: connection for key, connection in here.items() if counts[connection.address] == most
    }
    return max(busiest, key=lambda key: (not busiest[key].writes, busiest[key].idle))


def host_of(peer: object) -> str:
    """The host of a connection's other end."""
    return str(peer[0]) if isinstance(peer, tuple) and peer else ""
