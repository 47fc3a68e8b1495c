"""Raw exchanges as tests: frames in, frames out, inputs, faults and time between them.

A script has one step per line: `> 02 03 0C81 0001` sends a frame, `< 02 03 02 0237` expects a
reply, `< -` expects none. Checksums are omitted: they are added to sent frames and checked on
replies. `@ LI5=1` sets an input of the first drive, `! OCF` trips it, `. 3` lets 3 s pass. Text
after a `#` is a comment.
"""

from __future__ import annotations

from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.simulator import DriveSpec, LineTiming, SimulatedDrive
from tui.simulator.server.conversation import SimulatedLine
from tui.simulator.server.frames import seal

STEP = 0.02
ADDRESS = 2


class Exchange:
    """One drive at address 2 on its own line, with a clock that only the script advances."""

    def __init__(
        self,
        profile: str | Profile,
        sets: dict[str, int] | None = None,
        timing: LineTiming | None = None,
        **more: object,
    ) -> None:
        found = load(profile) if isinstance(profile, str) else profile
        spec = DriveSpec(found.id, ADDRESS, sets=sets or {}, **more)  # type: ignore[arg-type]
        timing = timing or LineTiming()
        self.drive = SimulatedDrive(found, spec, timing=timing)
        self.line = SimulatedLine([self.drive], timing, clock=lambda: 0.0)
        self._reply = ""

    def play(self, script: str) -> None:
        """Run a script; report the line that fails."""
        steps = [line.partition("#")[0].strip() for line in script.splitlines()]
        for number, step in enumerate(steps, 1):
            if step:
                self._do(step[0], step[1:].strip(), f"line {number}: {step}")

    def _do(self, kind: str, text: str, where: str) -> None:
        if kind == ">":
            reply = self.line.receive(seal(bytes.fromhex(text)))
            self._reply = _plain(reply.data) if reply else "-"
        elif kind == "<":
            assert self._reply == text.replace(" ", "").upper(), where
        elif kind == "@":
            name, _, value = text.partition("=")
            self.drive.set_input(name, value)
        elif kind == "!":
            self.drive.provoke(text)
        else:
            assert kind == ".", where
            self.wait(float(text))

    def wait(self, seconds: float) -> None:
        """Advance the time."""
        for _ in range(round(seconds / STEP)):
            self.drive.step(STEP)

    def word(self, code: str) -> int:
        """A word as the drive has it."""
        return self.drive.raw(code) & 0xFFFF


def _plain(frame: bytes) -> str:
    """A frame without its checksum, which must be correct."""
    assert seal(frame[:-2]) == frame
    return frame[:-2].hex().upper()
