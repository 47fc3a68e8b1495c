"""Line settings: a client with other settings than the drive gets no reply."""

from __future__ import annotations

import os
import select
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tui.simulator import ClientSettings, DriveSpec, LineTiming, Simulation
from tui.simulator.server.conversation import RtuConversation, SimulatedLine
from tui.simulator.server.faults import FaultPlan
from tui.simulator.server.frames import seal
from tui.simulator.troubles import FaultRates

from .exchange import Exchange
from .small import PROFILES
from .test_manual_frames import read

REQUEST = seal(bytes.fromhex("020323290001"))
REPLY = seal(bytes.fromhex("020302001E"))
LONG_ENOUGH = 0.5
"""Seconds without a byte after which no reply is expected."""


@contextmanager
def terminal(path: str, baud: int | None = None, stop_bits: int = 1) -> Iterator[int]:
    """The client's end; without a baud it sets only raw mode."""
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(port)
        if baud is not None:
            state = termios.tcgetattr(port)
            state[4] = state[5] = getattr(termios, f"B{baud}")
            state[2] = state[2] & ~termios.CSTOPB | (termios.CSTOPB if stop_bits == 2 else 0)
            termios.tcsetattr(port, termios.TCSANOW, state)
        yield port
    finally:
        os.close(port)


def heard(port: int) -> bool:
    os.write(port, REQUEST)
    if not select.select([port], [], [], LONG_ENOUGH)[0]:
        return False
    return read(port, len(REPLY)) == REPLY


def served(timing: LineTiming, **more: object) -> Simulation:
    drives = [DriveSpec("atv71", 2, **more)]  # type: ignore[arg-type]
    return Simulation(drives, timing=timing, profiles=PROFILES)


@pytest.mark.parametrize(("baud", "form"), [(19200, "8E1"), (9600, "8N2"), (9600, "8E1")])
def test_client_without_line_settings_is_answered(baud: int, form: str) -> None:
    with (
        served(LineTiming(baud, form)) as running,
        terminal(running.serve_pty()) as port,
    ):
        assert heard(port)


def test_client_without_line_settings_is_answered_by_a_drive_with_others() -> None:
    with (
        served(LineTiming(19200, "8E1"), sets={"TBR": 28, "TFO": 5}) as running,
        terminal(running.serve_pty()) as port,
    ):
        assert heard(port)


@pytest.mark.parametrize(
    ("form", "baud", "stop_bits", "answers"),
    [
        ("8E1", 9600, 1, True),
        ("8E1", 19200, 1, False),
        ("8E1", 9600, 2, False),
        ("8N2", 9600, 2, True),
        ("8N2", 9600, 1, False),
    ],
)
def test_baud_and_stop_bits_of_a_pseudo_terminal_matter(
    form: str, baud: int, stop_bits: int, answers: bool
) -> None:
    with (
        served(LineTiming(9600, form)) as running,
        terminal(running.serve_pty(), baud, stop_bits) as port,
    ):
        assert heard(port) is answers


def test_any_settings_option_ignores_client_settings() -> None:
    with (
        Simulation([DriveSpec("atv71", 2)], profiles=PROFILES, any_settings=True) as running,
        terminal(running.serve_pty(), 300, 2) as port,
    ):
        assert heard(port)


def test_drive_answers_at_its_new_baud_after_power_up() -> None:
    """TBR = 28 (9600) is in force after power-up; the old baud is deaf then."""
    change, save = (seal(bytes.fromhex(f"0206{words}")) for words in ("1773001C", "1F410001"))
    with (
        served(LineTiming(19200, "8E1")) as running,
        terminal(running.serve_pty(), 19200) as port,
    ):
        for write in (change, save):
            os.write(port, write)
            assert read(port, len(write)) == write
        assert heard(port), "not before the next power-up"
        running.drive(2).power_cycle()
        assert not heard(port)
        state = termios.tcgetattr(port)
        state[4] = state[5] = termios.B9600
        termios.tcsetattr(port, termios.TCSANOW, state)
        assert heard(port)


class OwnTransport:
    """A transport that transfers parity, like a wire: bytes with their settings."""

    def __init__(self, drive_format: str, client: ClientSettings) -> None:
        timing = LineTiming(19200, drive_format)
        sets = {"TFO": 3 if drive_format == "8E1" else 5}
        rig = Exchange(PROFILES["atv71"], sets, timing)
        line = SimulatedLine([rig.drive], timing, clock=lambda: 0.0)
        self.conversation = RtuConversation(line, FaultPlan(FaultRates(), 0), client=lambda: client)

    def exchange(self, frame: bytes) -> bytes:
        self.conversation.feed(frame, 0.0)
        return self.conversation.poll(1.0)


@pytest.mark.parametrize(
    ("drive", "parity", "stop_bits", "answers"),
    [
        ("8E1", "E", 1, True),
        ("8E1", "N", 1, False),
        ("8E1", "O", 1, False),
        ("8N2", "N", 2, True),
        ("8N2", "N", 1, False),
        ("8N2", "E", 2, False),
    ],
)
def test_parity_matters_if_detectable(
    drive: str, parity: str, stop_bits: int, answers: bool
) -> None:
    transport = OwnTransport(drive, ClientSettings(19200, parity, stop_bits))
    assert transport.exchange(REQUEST) == (REPLY if answers else b"")


def test_drives_at_different_bauds_answer_at_their_own_only() -> None:
    with Simulation(
        [DriveSpec("atv71", 2), DriveSpec("atv71", 3, sets={"TBR": 28})], profiles=PROFILES
    ) as running:
        for baud, answers in ((19200, 2), (9600, 3)):
            client = ClientSettings(baud, None, 1)
            replies = [
                running.line.receive(seal(bytes([address]) + REQUEST[1:-2]), client)
                for address in (2, 3)
            ]
            assert [r is not None for r in replies] == [answers == 2, answers == 3]


# What a damaged frame leaves in the counters


def test_atv71_frame_count_includes_damaged_frames() -> None:
    """Manual, Modbus counters: correct and incorrect ones, no broadcasts, its own address only."""
    rig = Exchange("atv71")
    rig.play("""
        > 02 08 000A 0000
        < 02 08 000A 0000
        > 02 03 0C81 0001
    """)
    good = seal(bytes.fromhex("02030C810001"))
    rig.line.receive(good[:-1] + bytes([good[-1] ^ 1]))
    rig.line.receive(seal(bytes.fromhex("03030C810001")))
    rig.line.receive(seal(bytes.fromhex("000623290020")))
    rig.play("""
        > 02 03 177A 0002
        < 02 03 04 0001 0003     # M1EC, M1CT: this request is the third
        > 02 08 000C 0000
        < 02 08 000C 0001
        > 02 08 000E 0000
        < 02 08 000E 0005
    """)
