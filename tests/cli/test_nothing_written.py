"""Statuses 2 and 5 promise that nothing was written: frames are counted at the simulated drive."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.mixer import (
    COMMAND,
    MIXER,
    PERCENT,
    REFERENCE,
    SCALE_BY,
    installed_mixer,
)
from tests.programs import drivepanel
from tui.simulator import DriveSpec, Simulation
from tui.simulator.drive import SimulatedDrive

from .commands import ended

WRITES = frozenset({5, 6, 15, 16, 22, 23})
RESET_COUNTERS = b"\x08\x00\x0a"


class Served(NamedTuple):
    """A simulated drive, its LINE, and the frames that wrote to it."""

    drive: SimulatedDrive
    line: str
    writes: list[tuple[int, int]]


@contextmanager
def counted(
    family: str, *, then: Callable[[SimulatedDrive, int], None] | None = None, **spec: object
) -> Iterator[Served]:
    """A drive that counts; `then` is called after each write with its register."""
    simulation = Simulation([DriveSpec(family, 1, **spec)])  # type: ignore[arg-type]
    drive, writes = simulation.drive(1), list[tuple[int, int]]()
    honest = drive.line_side.answer

    def answer(address: int, pdu: bytes) -> bytes | None:
        reply = honest(address, pdu)
        if pdu[0] in WRITES or pdu[:3] == RESET_COUNTERS:
            register = int.from_bytes(pdu[1:3], "big")
            writes.append((register, int.from_bytes(pdu[3:5], "big")))
            if then is not None:
                then(drive, register)
        return reply

    drive.line_side.answer = answer  # type: ignore[method-assign]
    with simulation:
        host, port = simulation.serve_tcp()
        yield Served(drive, f"tcp:{host}:{port}", writes)


class Refused(NamedTuple):
    """A refused command, with its message."""

    family: str
    words: tuple[str, ...]
    says: str
    status: int = 5
    sets: dict[str, int] = {}
    run_hz: float = 0.0


LOCKED = {"KEY": 1}
RUN = ("run", "--arm", "--for", "1")
REFUSED = {
    "run, not armed": Refused("atv71", ("run", "--reference", "20Hz"), "Not armed"),
    "run, read-only": Refused("atv71", (*RUN, "--read-only"), "read-only"),
    "run, interlock": Refused(MIXER, RUN, "key switch is on local", sets=LOCKED),
    "run at a reference, interlock": Refused(
        MIXER, (*RUN, "--reference", "20Hz"), "key switch is on local", sets=LOCKED
    ),
    "run at a reference, channel": Refused(
        "atv71", (*RUN, "--reference", "20Hz"), "not commanded by Modbus",
        sets={"CD1": 0, "CHCF": 2},
    ),
    "run at a reference, control not taken": Refused(
        "powerdrive", (*RUN, "-p", "powerdrive", "--reference", "20"), "takes the control first"
    ),
    "take control, reference": Refused(
        "powerdrive", (*RUN, "-p", "powerdrive", "--take-control", "--reference", "20"),
        "No available manual",
    ),
    "take control, none to take": Refused("atv71", (*RUN, "--take-control"), "no control to take"),
    "run above a limit": Refused(
        "atv71", (*RUN, "--reference", "90Hz"), "above HSP", 2, sets={"HSP": 500}
    ),
    "run, scale not known": Refused(
        MIXER, (*RUN, "--reference", "20Hz"), "its scale depends on MODE", sets={"MODE": 9}
    ),
    "run, another scale": Refused("atv71", RUN, "Bit 9 of CMI is set", sets={"CMI": 0x0200}),
    "reference, another scale": Refused(
        "atv312", ("reference", "20Hz", "--arm"), "Bit 9 of CMI is set", sets={"CMI": 0x0200}
    ),
    "reference, not armed": Refused("atv71", ("reference", "20Hz"), "Not armed"),
    "reference above a limit": Refused(
        "atv71", ("reference", "90Hz", "--arm"), "above HSP", 2, sets={"HSP": 500}
    ),
    "reference, read-only": Refused(
        "atv71", ("reference", "20Hz", "--arm", "--read-only"), "read-only"
    ),
    "reset, not armed": Refused("atv71", ("reset",), "Not armed"),
    "reset, no fault": Refused("atv71", ("reset", "--arm"), "No fault to reset"),
    "write, not armed": Refused("atv71", ("write", "ACC=5"), "Not armed"),
    "write above a limit": Refused("atv71", ("write", "LSP=60", "--arm"), "above HSP", 2),
    "write, a command": Refused("atv71", ("write", "CMD=6", "--arm"), "is a command", 2),
    "write, motor runs": Refused(
        "atv312", ("write", "FrS=60", "--arm"), "with the motor stopped", run_hz=20.0
    ),
    "write, read-only": Refused("atv71", ("write", "ACC=5", "--arm", "--read-only"), "read-only"),
    "block, not armed": Refused("atv71", ("block", "set", "NMA3=LCR"), "Not armed"),
    "block, motor runs": Refused(
        "atv71", ("block", "set", "NMA3=LCR", "--arm"), "with the motor stopped", run_hz=20.0
    ),
    "prove, not armed": Refused("atv71", ("prove",), "Not armed"),
    "prove, motor runs": Refused("atv71", ("prove", "--arm"), "", run_hz=20.0),
    "prove turning, no yes": Refused("atv71", ("prove", "--arm", "--turning"), "--yes"),
    "stop, read-only": Refused("atv71", ("stop", "--read-only"), "read-only"),
    "counters, read-only": Refused(
        "atv71", ("counters", "--reset-drive", "--arm", "--read-only"), "are not reset"
    ),
    "counters, not armed": Refused("atv71", ("counters", "--reset-drive"), "Not armed"),
    "another family": Refused("atv71", ("reset", "--arm", "-p", "atv312"), "Nothing was written"),
}  # fmt: skip


PROCESSES = ("run, not armed", "run at a reference, interlock", "run, another scale")
"""The refusals of `run` outside the sweeps."""


def errors_of(status: int, command: str, *words: str) -> str:
    """End with this status; return standard error. `run` needs a process of its own."""
    if command != "run":
        return ended(status, command, *words).stderr
    done = drivepanel(command, *words)
    assert done.returncode == status, done.stderr
    return done.stderr


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(
            case,
            id=name,
            marks=() if case.words[0] != "run" or name in PROCESSES else pytest.mark.sweep,
        )
        for name, case in REFUSED.items()
    ],
)
def test_status_2_or_5_means_that_nothing_was_written(case: Refused) -> None:
    installed_mixer(SCALE_BY)
    with counted(case.family, sets=case.sets, run_hz=case.run_hz) as served:
        command, *more = case.words
        profile = ("-p", MIXER) if case.family == MIXER else ()
        errors = errors_of(case.status, command, served.line, *more, *profile)
        assert served.writes == []
        assert case.says in errors


def test_nothing_is_restored_or_loaded_unarmed(tmp_path: Path) -> None:
    with counted("atv71") as served:
        kept, slots = str(tmp_path / "set.toml"), str(tmp_path / "slots.toml")
        ended(0, "backup", served.line, kept)
        ended(0, "block", served.line, "save", slots)
        for words in (("restore", served.line, kept), ("block", served.line, "load", slots)):
            ended(5, *words)
        assert served.writes == []


def test_fault_blocks_the_reference_too() -> None:
    with counted("atv71") as served:
        served.drive.provoke("OCF", persists=True)
        done = drivepanel("run", served.line, *RUN[1:], "--reference", "20Hz")
        assert (done.returncode, served.writes) == (5, []), done.stderr
        assert "reset it first" in done.stderr


def test_start_that_cannot_be_recorded_writes_no_reference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "file"))
    with counted("atv71") as served:
        done = drivepanel("run", served.line, *RUN[1:], "--reference", "20Hz")
        assert (done.returncode, served.writes) == (5, []), done.stderr
        assert "--unrecorded" in done.stderr


@pytest.mark.parametrize("command", [RUN, ("reference", "--arm")], ids=["run", "reference"])
def test_unknown_unit_of_the_reference_exits_with_2(command: tuple[str, ...]) -> None:
    installed_mixer(PERCENT)
    word = ("--reference", "20Hz") if command == RUN else ("20Hz",)
    with counted(MIXER) as served:
        errors = errors_of(2, command[0], served.line, *word, *command[1:], "-p", MIXER)
        assert served.writes == []
        assert "REF takes its reference in %. Type it like 40%." in errors


def test_interlock_lost_during_the_start_exits_with_4() -> None:
    """The key is turned between the reference and the run word: the drive does not follow."""
    installed_mixer(SCALE_BY)

    def turn(drive: SimulatedDrive, register: int) -> None:
        if register == REFERENCE:
            drive.set("KEY", 1)

    with counted(MIXER, sets={"MODE": 1}, then=turn) as served:
        done = drivepanel("run", served.line, *RUN[1:], "--reference", "20Hz", "-p", MIXER)
        assert done.returncode == 4, done.stderr
        assert "The drive does not run" in done.stderr
        assert served.writes[:2] == [(REFERENCE, 200), (COMMAND, 1)]
        assert served.writes[-1] == (COMMAND, 0), "it is stopped"


def test_scale_changed_during_the_start_exits_with_6() -> None:
    installed_mixer(SCALE_BY)

    def change(drive: SimulatedDrive, register: int) -> None:
        if register == REFERENCE:
            drive.set("MODE", 2)

    with counted(MIXER, sets={"MODE": 1}, then=change) as served:
        done = drivepanel("run", served.line, *RUN[1:], "--reference", "20Hz", "-p", MIXER)
        assert (done.returncode, served.writes) == (6, [(REFERENCE, 200)]), done.stderr
        assert "Not started: REF holds 200 Hz, 20 Hz was requested." in done.stderr
        assert "Sent by this command: REF = 20.0 Hz." in done.stderr
        assert served.drive.motor.frequency == 0


def test_run_checks_the_reference_before_taking_control() -> None:
    """Reasons to refuse the reference are known before the terminals lose control."""
    with counted("powerdrive") as served:
        done = drivepanel("run", served.line, *RUN[1:], "-p", "powerdrive", "--take-control")
        assert done.returncode == 0, done.stderr
        assert len(served.writes) > 1
