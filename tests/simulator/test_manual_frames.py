"""Every example frame of the manuals, byte for byte: sent directly and over a pseudo-terminal.

A frame with a misprinted checksum gets no reply; with the right checksum it does.
"""

from __future__ import annotations

import os
import select
import time
import tty

import pytest

from tui.simulator import FaultRates, Simulation
from tui.simulator.server.frames import seal

from .manual import EXAMPLES, FRAMES, NEVER_ANSWERED, Example

ids = [example.name for example in EXAMPLES]


def simulated(example: Example) -> Simulation:
    simulation = Simulation([example.spec], faults=FaultRates())
    example.prepare(simulation.drives[0])
    return simulation


def expected(example: Example) -> bytes:
    if example.response is None:
        return seal(bytes.fromhex(example.answer))
    return FRAMES[example.response].data


def test_every_manual_frame_is_used() -> None:
    used = {e.request for e in EXAMPLES} | {e.response for e in EXAMPLES} | NEVER_ANSWERED
    assert {frame.number for frame in FRAMES} <= used


@pytest.mark.parametrize("example", EXAMPLES, ids=ids)
def test_drive_answers_as_printed_in_its_manual(example: Example) -> None:
    reply = simulated(example).line.receive(FRAMES[example.request].data)
    assert reply is not None
    assert reply.data.hex() == expected(example).hex()


@pytest.mark.parametrize(
    "example", [e for e in EXAMPLES if FRAMES[e.request].printed], ids=lambda e: e.name
)
def test_misprinted_checksum_is_not_answered(example: Example) -> None:
    printed = FRAMES[example.request].printed
    assert printed is not None
    assert simulated(example).line.receive(printed) is None


@pytest.mark.parametrize("example", EXAMPLES, ids=ids)
def test_drive_answers_as_printed_over_a_pseudo_terminal(example: Example) -> None:
    with simulated(example) as simulation:
        port = os.open(simulation.serve_pty(), os.O_RDWR | os.O_NOCTTY)
        try:
            tty.setraw(port)
            os.write(port, FRAMES[example.request].data)
            wanted = expected(example)
            assert read(port, len(wanted)).hex() == wanted.hex()
        finally:
            os.close(port)


def read(port: int, size: int, patience: float = 5.0) -> bytes:
    """Read this many bytes from a terminal, or fewer at the timeout."""
    data = b""
    end = time.monotonic() + patience
    while len(data) < size and (left := end - time.monotonic()) > 0:
        if select.select([port], [], [], left)[0]:
            data += os.read(port, size - len(data))
    return data
