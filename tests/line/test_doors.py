"""Doors run in serve: the process that holds the line knows none of them, and outlives all."""

from __future__ import annotations

import os
import re
import signal
from contextlib import ExitStack
from pathlib import Path
from urllib.request import urlopen

import pytest

from tests.programs import PATIENCE, end_keepers, keepers, served, wait_until

from .test_commands import bench, stands, turns
from .test_serve import ENABLED, Gateway, gateway, serving, started_by_a_client

DOORS = re.compile(
    r"(paho|aiomqtt|http|pymodbus\.server|tui\.bus\.gateway|tui\.session\.gateway|tui\.cli"
    r"|textual|rich|click)(\.|$)"
)
"""Modules of Modbus TCP, metrics and MQTT, and of the screens."""
AT_EXIT = """
import atexit, os, sys
if "tui.keeper" in sys.orig_argv:
    path = os.environ["MODULES_OF_KEEPER"]
    atexit.register(lambda: open(path, "w").write("\\n".join(sys.modules)))
"""


def test_keeper_of_serve_imports_no_network_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sitecustomize.py").write_text(AT_EXIT)
    loaded = tmp_path / "modules"
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("MODULES_OF_KEEPER", str(loaded))
    with bench(ENABLED) as (simulation, line), ExitStack() as stack:
        doors = ("--tcp", "127.0.0.1:0", "--allow-commands", "--metrics", "127.0.0.1:0")
        broker = ("--mqtt", "mqtt://127.0.0.1:9/drives")
        command = serving(f"{line}@1", *doors, *broker)
        program = stack.enter_context(served(command, ready="Ready:"))
        found = re.search(r"http://\S+/metrics", program.ready)
        assert found is not None
        started_by_a_client(Gateway(simulation, line, program))
        with urlopen(found[0], timeout=PATIENCE) as answer:
            assert b"drivepanel_line_connected" in answer.read()
        program.process.kill()
        wait_until(lambda: stands(simulation), "the keeper stops the motor")
        end_keepers()
    wait_until(loaded.exists, "the keeper has ended")
    modules = loaded.read_text().split()
    assert "tui.keeper.process" in modules
    assert [module for module in modules if DOORS.match(module)] == []


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP, signal.SIGABRT])
def test_keeper_stops_motor_of_client_when_serve_dies(number: signal.Signals) -> None:
    """No other program is on the line."""
    with gateway("--allow-commands", specs=(ENABLED,)) as made:
        started_by_a_client(made)
        (keeper,) = keepers()
        os.kill(made.program.process.pid, number)
        wait_until(lambda: stands(made.simulation), "the motor stops")
        assert made.simulation.drive(1).fault is None
        assert keepers() == [keeper]
        assert not turns(made.simulation)
        if number is signal.SIGSTOP:
            os.kill(made.program.process.pid, signal.SIGKILL)
