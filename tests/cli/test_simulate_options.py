"""Options of `drivepanel simulate`: the drives and the line that they describe, complete.

Nothing is served.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.cli.commands import invoked, tcp_line
from tests.session.test_ghost_record import record_of_one_reply
from tui.simulator import DriveSpec, FaultRates, Habits, LineTiming
from tui.simulator.errors import SimulatorError

COMMANDS = "tui.cli.commands"


def specified(monkeypatch: pytest.MonkeyPatch, *words: str) -> tuple[Any, dict[str, Any]]:
    """The drives and the line that `simulate` would make."""
    made: list[Any] = []

    def simulation(specs: Any, **how: Any) -> None:
        made.append((specs, how))
        raise SimulatorError("This is enough.")

    monkeypatch.setattr("tui.simulator.Simulation", simulation)
    with pytest.raises(SimulatorError), tcp_line(*words):
        pass
    return made[0]  # type: ignore[no-any-return]


def test_simulation_without_options(monkeypatch: pytest.MonkeyPatch) -> None:
    specs, line = specified(monkeypatch, "atv71@2", "atv312")
    assert specs == [DriveSpec("atv71", 2), DriveSpec("atv312", 1)]
    assert line == {
        "timing": LineTiming(19200, "8E1", real_time=False), "faults": FaultRates(),
        "habits": Habits(), "seed": 0, "any_settings": False, "ghosts": (),
    }  # fmt: skip
    _, line = specified(monkeypatch, "v20")
    assert line["timing"] == LineTiming(9600, "8E1")


def test_simulation_with_all_options(monkeypatch: pytest.MonkeyPatch) -> None:
    specs, line = specified(
        monkeypatch, "atv71@2", "atv312@3", "--set", "ACC=30", "--set", "3:dEC=16#21",
        "--set", "2:HSP=-1", "--protect", "ACC,HSP", "--protect", "2:LSP", "--baud", "9600",
        "--format", "8n1", "--real-time", "--any-settings", "--seed", "7", "--run", "-20",
        "--line-fault", "lost=0.25", "--line-fault", "behind=2",
    )  # fmt: skip
    assert specs == [
        DriveSpec("atv71", 2, {"ACC": 30, "HSP": -1}, frozenset({"ACC", "HSP", "LSP"}),
                  run_hz=-20.0, wander=True),
        DriveSpec("atv312", 3, {"ACC": 30, "dEC": 0x21}, frozenset({"ACC", "HSP"}),
                  run_hz=-20.0, wander=True),
    ]  # fmt: skip
    assert line == {
        "timing": LineTiming(9600, "8N1", real_time=True), "faults": FaultRates(lost=0.25),
        "habits": Habits(behind=2), "seed": 7, "any_settings": True, "ghosts": (),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--set", "9:ACC=1"), "'9:ACC=1': no simulated drive has address 9."),
        (("--protect", "9:ACC"), "'9:ACC': no simulated drive has address 9."),
        (("--set", "ACC"), "'ACC': write CODE=RAW, for example ACC=30."),
        (("--set", "2:ACC=x"), "'2:ACC=x': write CODE=RAW, for example ACC=30."),
        (("--set", "ACC=65536"), "'ACC=65536': 65536 does not fit a word of 16 bits."),
        (("--set", "ACC=-32769"), "'ACC=-32769': -32769 does not fit a word of 16 bits."),
        (("--line-fault", "odd=1"), "'odd=1': a line fault is one of late, lost, "),
        (("--line-fault", "late=x"), "'late=x': write KIND=VALUE, for example late=0.15."),
        (("--line-fault", "lost=2"), "'lost=2': write KIND=VALUE; lost takes 0 to 1 "),
    ],
)
def test_simulation_that_cannot_be_is_refused(words: tuple[str, ...], text: str) -> None:
    done = invoked("simulate", "atv71@2", "--tcp", "127.0.0.1:0", *words)
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr.startswith(f"drivepanel: {text}")


def test_limits_of_a_set_word_are_those_of_16_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("--set", "ACC=65535", "--set", "DEC=-32768", "--set", "HSP= 0x10 ")
    specs, _ = specified(monkeypatch, "atv71@2", *words)
    assert specs[0].sets == {"ACC": 65535, "DEC": -32768, "HSP": 16}


PLACES = {
    ("--pty", "P"): ("serve_pty", ("P",), "serial:P"),
    ("--pty", "P", "--baud", "9600"): ("serve_pty", ("P",), "serial:P,9600,8E1"),
    ("--pty", "P", "--format", "8N2"): ("serve_pty", ("P",), "serial:P,19200,8N2"),
    ("--serial", "P"): ("serve_stream", ("P 19200 8E1",), "serial:P,19200,8E1"),
    ("--tcp", "[::1]:5"): ("serve_tcp", ("::1", 5), "tcp:[::1]:5"),
    ("--rtu-tcp", "6"): ("serve_rtu_tcp", ("127.0.0.1", 6), "rtu-tcp:127.0.0.1:6"),
}
"""By the words: the endpoint of the simulation, its arguments, and the LINE."""


@pytest.mark.parametrize("words", PLACES)
@pytest.mark.parametrize("as_json", [False, True])
def test_place_of_a_simulation(
    words: tuple[str, ...], as_json: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    served: list[Any] = []

    def endpoint(name: str) -> Callable[..., Any]:
        def serve(_: object, *given: Any) -> Any:
            served.append((name, given))
            return given

        return serve

    for name in {name for name, _, _ in PLACES.values()}:
        monkeypatch.setattr(f"tui.simulator.Simulation.{name}", endpoint(name))
    monkeypatch.setattr(
        "tui.bus.transport.ports.open_serial", lambda *given: " ".join(map(str, given))
    )
    at_once = SimpleNamespace(set=lambda: None, wait=lambda _: True)
    thread = SimpleNamespace(start=lambda: None)
    threads = SimpleNamespace(Event=lambda: at_once, Thread=lambda **_: thread)
    monkeypatch.setattr(f"{COMMANDS}.simulate.threading", threads)
    ghost = f"{record_of_one_reply(tmp_path)}@2"
    done = invoked(
        "simulate",
        "atv71@7",
        "atv312@5",
        "--from",
        ghost,
        *words,
        *(("--json",) if as_json else ()),
    )
    name, given, line = PLACES[words]
    assert served == [(name, given)]
    if as_json:
        assert f'"line": "{line}", "drives": [{{"profile": "atv71", "device": 7}}, ' in done.stdout
        assert '"device": 2' in done.stdout.partition('"ghosts": ')[2]
    else:
        assert done.stdout.startswith("Ready: atv71@7, atv312@5, ghost@2 (")
        assert done.stdout.endswith(f") on {line}. Ctrl-C ends it.\n")
    assert done.exit_code == 0, done.output
