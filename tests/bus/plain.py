"""The plain clients of the protocol library, to show what the line does better."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager

from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu.pdu import ModbusPDU


@asynccontextmanager
async def plain_serial(
    path: str, *, timeout: float = 0.3, retries: int = 0, baud: int = 19200, echo: bool = False
) -> AsyncIterator[AsyncModbusSerialClient]:
    """A connected plain serial client."""
    client = AsyncModbusSerialClient(
        path, baudrate=baud, timeout=timeout, retries=retries, handle_local_echo=echo
    )
    assert await client.connect()
    try:
        yield client
    finally:
        client.close()


@asynccontextmanager
async def plain_tcp(port: int, *, timeout: float = 0.3) -> AsyncIterator[AsyncModbusTcpClient]:
    """A connected plain TCP client."""
    client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=timeout, retries=0)
    assert await client.connect()
    try:
        yield client
    finally:
        client.close()


async def outcome(call: Awaitable[ModbusPDU]) -> list[int] | None:
    """Registers that a plain client accepts as the answer, None if it accepts none."""
    try:
        answer = await call
    except ModbusException:
        return None
    return None if answer.isError() else list(answer.registers)
