"""A simulated drive on a bench: read by its words, stepped by the test."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from tui.simulator import DriveSpec, SimulatedDrive

from .small import PROFILES

ADDRESS = 2


class Bench:
    """One drive with a small profile at address 2."""

    def __init__(self, profile: str, sets: Mapping[str, int] | None = None, **more: object) -> None:
        spec = DriveSpec(profile, ADDRESS, sets=sets or {}, **more)  # type: ignore[arg-type]
        self.drive = SimulatedDrive(PROFILES[profile], spec)

    def ask(self, pdu: str) -> str | None:
        """A request and its reply, both PDUs in hexadecimal."""
        reply = self.drive.line_side.answer(ADDRESS, bytes.fromhex(pdu))
        return None if reply is None else reply.hex().upper()

    def address(self, code: str) -> int:
        return self.drive.profile.find(code).address

    def write(self, code: str, raw: int) -> str | None:
        """Write one word with function 6; the reply in hexadecimal."""
        return self.ask(struct.pack(">BHH", 6, self.address(code), raw & 0xFFFF).hex())

    def taken(self, code: str, raw: int) -> None:
        """Write one word that must be accepted."""
        reply = self.write(code, raw)
        assert reply is not None, f"{code}: no reply"
        assert reply.startswith("06"), f"{code}: {reply}"

    def word(self, code: str) -> int:
        """A word as the line reads it, with function 3."""
        reply = self.ask(struct.pack(">BHH", 3, self.address(code), 1).hex())
        assert reply is not None, f"{code}: no reply"
        assert reply.startswith("0302"), f"{code}: {reply}"
        return int(reply[4:], 16)

    def run(self, seconds: float, step: float = 0.02) -> None:
        """Advance the time."""
        for _ in range(round(seconds / step)):
            self.drive.step(step)
