"""A Modbus server on modbus-tk, for tests: `tk_server.py tcp` or `tk_server.py rtu PATH`.

A separate process keeps its threads and warnings out of the tests.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time

import serial
from modbus_tk import defines, modbus_rtu, modbus_tcp

DEVICE = 2
WORDS = {3201: [0x0637, 425], 9001: [57], 9020: [1]}


def main(kind: str, path: str = "") -> None:
    """Serve the words until SIGTERM."""
    over_tcp = kind == "tcp"
    server = (
        modbus_tcp.TcpServer(port=0, address="127.0.0.1")
        if over_tcp
        else modbus_rtu.RtuServer(serial.Serial(path, 19200, timeout=0.5))
    )
    drive = server.add_slave(DEVICE)
    for address, words in WORDS.items():
        drive.add_block(str(address), defines.HOLDING_REGISTERS, address, len(words))
        drive.set_values(str(address), address, words)
    ended = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: ended.set())
    server.start()
    print("ready on", f"tcp:127.0.0.1:{_port(server)}" if over_tcp else path, flush=True)
    ended.wait()
    server.stop()


def _port(server: modbus_tcp.TcpServer) -> int:
    """The port that the server's thread bound; it binds some time after `start`."""
    while True:
        with contextlib.suppress(AttributeError, OSError):
            if port := int(server._sock.getsockname()[1]):
                return port
        time.sleep(0.01)


if __name__ == "__main__":
    main(*sys.argv[1:])
