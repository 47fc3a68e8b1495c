"""Troubles of a simulated line, on the wire, with a plain pymodbus client."""

from __future__ import annotations

import contextlib
import re
import socket
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU

from tui.simulator import TROUBLES, DriveSpec, FaultRates, Simulation, SimulatorError, troubles_of
from tui.simulator.server.faults import FaultPlan
from tui.simulator.server.frames import is_sealed, seal
from tui.simulator.troubles import SHARE

ETA, RFR = 3201, 3202
STATUS, FREQUENCY = 0x0637, 425
PAGE = Path(__file__).resolve().parents[2] / "docs" / "cli.md"


@contextlib.contextmanager
def sick(troubles: Mapping[str, float], scheme: str = "tcp") -> Iterator[tuple[str, int]]:
    """An Altivar 71 at address 2 on a line with these troubles; host and port."""
    rates, habits = troubles_of(troubles)
    drive = DriveSpec("atv71", 2, sets={"ETA": STATUS, "RFR": FREQUENCY})
    with Simulation([drive], faults=rates, habits=habits) as simulation:
        yield simulation.serve_tcp() if scheme == "tcp" else simulation.serve_rtu_tcp()


@contextlib.contextmanager
def client(place: tuple[str, int], framer: FramerType = FramerType.SOCKET) -> Iterator[Client]:
    """A pymodbus client that does not repeat a request."""
    host, port = place
    made = ModbusTcpClient(host, port=port, framer=framer, timeout=1, retries=0)
    assert made.connect()  # type: ignore[no-untyped-call]
    try:
        yield Client(made)
    finally:
        made.close()  # type: ignore[no-untyped-call]


class Client:
    """Reads of one word: the word, an exception code as `ex 10`, or None for no reply."""

    def __init__(self, made: ModbusTcpClient) -> None:
        self._made = made

    def read(self, address: int, unit: int = 2) -> int | str | None:
        """One word of a drive."""
        try:
            reply: ModbusPDU = self._made.read_holding_registers(address, count=1, device_id=unit)
        except ModbusException:
            self._made.connect()  # type: ignore[no-untyped-call]
            return None
        return f"ex {reply.exception_code}" if reply.isError() else reply.registers[0]


def test_replies_one_behind_have_the_value_of_the_previous_read() -> None:
    with sick({"behind": 1}, "rtu-tcp") as place, client(place, FramerType.RTU) as item:
        assert item.read(ETA) is None
        assert [item.read(RFR), item.read(ETA), item.read(ETA)] == [STATUS, FREQUENCY, STATUS]


def test_each_second_request_is_lost() -> None:
    with sick({"lost-every": 2}) as place, client(place) as item:
        found = [item.read(ETA) for _ in range(4)]
    assert found == [STATUS, None, STATUS, None]


def test_lost_request_does_not_reach_the_drive() -> None:
    rates, habits = troubles_of({"lost-every": 2})
    with Simulation([DriveSpec("atv71", 2)], faults=rates, habits=habits) as simulation:
        place = simulation.serve_tcp()
        with client(place) as item:
            for _ in range(4):
                item.read(ETA)
        assert simulation.drive(2).server.counters.frames == 2


@pytest.mark.parametrize("code", [10, 11])
def test_gateway_replies_with_its_exception(code: int) -> None:
    with sick({f"exception-0{code:x}": 1}) as place, client(place) as item:
        assert item.read(ETA) == f"ex {code}"


def test_bytes_of_words_are_swapped() -> None:
    with sick({"swapped": 1}) as place, client(place) as item:
        assert item.read(ETA) == 0x3706


@pytest.mark.parametrize("unit", [255, 0])
def test_gateway_answers_one_unit_only(unit: int) -> None:
    with sick({"only-unit": unit}) as place, client(place) as item:
        assert item.read(ETA, unit=2) is None
    with sick({"only-unit": unit}) as place, socket.create_connection(place, timeout=5) as plain:
        # pymodbus does not wait for a reply of unit 0
        plain.sendall(bytes.fromhex(f"000100000006{unit:02X}030C810001"))
        assert plain.recv(300) == bytes.fromhex(f"000100000005{unit:02X}03020637")


def test_idle_connection_is_closed_and_a_busy_one_is_not() -> None:
    with sick({"idle-close": 0.5}) as place:
        with client(place) as item:
            for _ in range(4):
                assert item.read(ETA) == STATUS
        with socket.create_connection(place, timeout=10) as idle:
            began = time.monotonic()
            assert idle.recv(1) == b""
            assert time.monotonic() - began > 0.4


def test_gateway_that_speaks_rtu_only_does_not_answer_modbus_tcp() -> None:
    with sick({}, "rtu-tcp") as place:
        with client(place) as wrong:
            assert wrong.read(ETA) is None
        with client(place, FramerType.RTU) as right:
            assert right.read(ETA) == STATUS


def test_another_master_is_heard_without_a_request() -> None:
    with (
        sick({"master": 0.05}, "rtu-tcp") as place,
        socket.create_connection(place, timeout=10) as listener,
    ):
        heard = b""
        while len(heard) < 4 * 15:
            heard += listener.recv(300)
    request, reply = seal(bytes.fromhex("02030C810001")), seal(bytes.fromhex("0203020637"))
    assert heard[:60] == 4 * (request + reply)


def test_two_drives_at_one_address_collide_in_both_orders() -> None:
    plan = FaultPlan(FaultRates(twin=1), 1)
    frame = seal(bytes.fromhex("0203020637"))
    [(_, broken)] = plan.carry(frame)
    assert not is_sealed(broken)
    first, second = [data for _, data in plan.carry(frame)]
    assert first == frame
    assert is_sealed(second)
    assert second != frame


def test_two_drives_at_one_address_on_the_wire() -> None:
    with sick({"twin": 1}, "rtu-tcp") as place, client(place, FramerType.RTU) as item:
        found = [item.read(ETA) for _ in range(4)]
    assert found[1] == STATUS
    assert None in found


@pytest.mark.parametrize(
    "troubles",
    [
        {"fire": 1.0},
        {"late": 1.1},
        {"lost": 0.6, "late": 0.6},
        {"only-unit": 256},
        {"only-unit": 0.5},
        {"behind": 0},
        {"master": 0},
        {"idle-close": float("nan")},
    ],
)
def test_trouble_out_of_range_is_refused(troubles: Mapping[str, float]) -> None:
    with pytest.raises(SimulatorError):
        troubles_of(troubles)


def test_shares_match_the_table_and_the_page_lists_all() -> None:
    assert set(FaultRates().by_kind()) == {k for k, t in TROUBLES.items() if t.unit == SHARE}
    page = PAGE.read_text(encoding="utf-8").partition("\n## simulate\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([\w-]+)=[\d.]+` \| ([^|]+) \|$", page, re.MULTILINE)
    assert dict(rows) == {k: t.effect for k, t in TROUBLES.items()}
