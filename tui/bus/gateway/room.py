"""Makes room for a further connection to a server that keeps a limited number.

Each address that clients come from has a share: the one with the most connections gives one of
its own. So no number of connections keeps a client out that must stop a motor. One that waits for
the answer to a write goes last: it may be a stop. That is carried out, but not answered.
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
    """Seconds since its last request, or since it came; 0 while a read waits for its answer."""
    writes: bool = False
    """True while a write of it is not answered yet."""


def makes_room(address: str, here: Mapping[K, ServedConnection]) -> K:
    """The connection that goes for a further one from an address.

    Of the address that would have the most connections it is the one that was idle for longest.
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
