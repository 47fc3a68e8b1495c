"""Error counts of a serial port: broken characters and breaks."""

from __future__ import annotations

import array
import os
from contextlib import suppress
from typing import NamedTuple

FRAMING, OVERRUN, PARITY, BREAKS, LOST = 6, 7, 8, 9, 10
"""Places in the system's table of counts (`serial_icounter_struct`)."""
COUNTS = 20


class PortErrors(NamedTuple):
    """Counts since the driver was loaded; only their increase is meaningful."""

    framing: int
    """Characters without a stop bit where one was due: another baud, or another format."""
    parity: int
    breaks: int
    overruns: int
    """Characters that the port or the system lost."""

    def since(self, before: PortErrors) -> PortErrors:
        """Return the errors since then; a driver that was reloaded counts from 0."""
        grown = [now - then for now, then in zip(self, before, strict=True)]
        return self if min(grown) < 0 else PortErrors(*grown)


def port_errors(descriptor: int) -> PortErrors | None:
    """The counts of an open port; None if the system or the driver does not report them."""
    if os.name != "posix":
        return None
    import fcntl
    import termios

    asks = getattr(termios, "TIOCGICOUNT", None)
    if asks is None:
        return None
    counts = array.array("i", [0] * COUNTS)
    with suppress(OSError):
        fcntl.ioctl(descriptor, asks, counts)
        return PortErrors(
            counts[FRAMING], counts[PARITY], counts[BREAKS], counts[OVERRUN] + counts[LOST]
        )
    return None
