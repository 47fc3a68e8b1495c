"""Settings of the client of a simulated line, as far as the simulator can see them."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass

from ..spec import LineTiming

_ISPEED, _OSPEED, _CFLAG = 4, 5, 2


@dataclass(frozen=True, slots=True)
class ClientSettings:
    """Baud, parity and stop bits of the client; None if not visible."""

    baud: int | None = None
    parity: str | None = None
    stop_bits: int | None = None

    def fits(self, baud: int, form: str) -> bool:
        """Return True if a drive with this baud and format can communicate with the client."""
        return (
            self.baud in (None, baud)
            and self.parity in (None, form[1])
            and self.stop_bits in (None, int(form[2]))
        )

    def pace(self, timing: LineTiming) -> LineTiming:
        """Return the line's timing with the client's settings instead of its own."""
        form = timing.format
        if self.stop_bits is not None:
            form = f"{form[:2]}{self.stop_bits}"
        return LineTiming(self.baud or timing.baud, form, timing.real_time)


def settings_of_terminal(handle: int) -> ClientSettings:
    """Return baud and stop bits of a pseudo-terminal; the kernel keeps no parity there."""
    import termios

    with contextlib.suppress(termios.error):
        state = termios.tcgetattr(handle)
        bauds = {constant: baud for baud, constant in _bauds().items()}
        stop_bits = 2 if state[_CFLAG] & termios.CSTOPB else 1
        return ClientSettings(bauds.get(state[_OSPEED], 0), None, stop_bits)
    return ClientSettings()


def set_up_terminal(handle: int, timing: LineTiming) -> bool:
    """Set a pseudo-terminal to a line's baud and stop bits, for clients that set nothing.

    Returns False if the system has no such baud: then its settings show nothing.
    """
    import termios

    constant = _bauds().get(timing.baud)
    if constant is None:
        return False
    state = termios.tcgetattr(handle)
    state[_ISPEED] = state[_OSPEED] = constant
    state[_CFLAG] &= ~termios.CSTOPB
    if timing.format[2] == "2":
        state[_CFLAG] |= termios.CSTOPB
    termios.tcsetattr(handle, termios.TCSANOW, state)
    return True


def _bauds() -> dict[int, int]:
    """Return the system's constants by baud."""
    import termios

    return {
        int(name[1:]): getattr(termios, name)
        for name in dir(termios)
        if re.fullmatch(r"B[1-9]\d*", name)
    }
