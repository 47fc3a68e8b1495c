"""Warning of every command at its end about a communication timeout that it leaves running."""

from __future__ import annotations

import asyncio
import json
import signal
from collections.abc import Iterator
from contextlib import nullcontext
from typing import Any

import pytest

from tests.programs import DRIVEPANEL, PATIENCE, drivepanel, served, wait_until
from tests.sweeps import kept
from tui.cli.shared.errors import DONE, DRIVE_REFUSED, Failure
from tui.cli.shared.looking_after import to_its_end
from tui.session.connect.open_line import OpenLine

from .commands import ended, held, put, refused, run, tcp_line

pytestmark = pytest.mark.long

CMD, STATUS_21, F803 = 8501, 0xFD01, 2051
ERR5 = {"seconds": 3.0, "reaction": "Coast stop", "fault": "Err5", "begun": True}


@pytest.fixture(scope="module")
def atv21() -> Iterator[str]:
    with tcp_line("atv21@1") as line:
        yield line


READING: dict[str, tuple[str, ...]] = {
    "read": ("read", "{line}", "FD01"),
    "status": ("status", "{line}"),
    "identify": ("identify", "{line}"),
    "watch": ("watch", "{line}", "FD01", "--count", "1"),
    "block": ("block", "{line}"),
}
OTHERS: dict[str, tuple[str, ...]] = {
    "write": ("write", "{line}", "F803=3s", "--arm"),
    "a trial of write": ("write", "{line}", "ACC=5s", "--dry-run"),
    "backup": ("backup", "{line}", "{folder}/b.toml"),
    "report": ("report", "{line}", "{folder}/r.md"),
    "compare": ("compare", "{line}", "{line}"),
    "teach": ("teach", "{line}"),
    "stop": ("stop", "{line}"),
}


@pytest.mark.parametrize("command", [*READING, *OTHERS])
def test_warning_names_drive_timeout_reaction_and_remedy(
    atv21: str, command: str, tmp_path: object
) -> None:
    words = (READING | OTHERS)[command]
    done = ended(0, *(word.format(line=atv21, folder=tmp_path) for word in words))
    assert (
        "Device 1, Altivar 21: its communication timeout F803 runs. After 3 s without a request:"
        " Switches the output off and trips with Err5; the motor coasts.\n"
        f"To keep polling it: drivepanel hold {atv21} -d 1." in done.stderr
    )
    assert done.stderr.endswith(f"After a trip: drivepanel reset {atv21} -d 1 --arm.\n")


@pytest.mark.parametrize("command", READING)
def test_json_has_the_timeout_in_every_command(atv21: str, command: str) -> None:
    words = [text.format(line=atv21) for text in READING[command]]
    reported = json.loads(run(0, *words, "--json"))
    assert reported["timeout"] == ERR5
    if command == "status":
        assert reported["watch"]["timeout_s"] == reported["timeout"]["seconds"]


def test_warning_is_shown_if_the_command_fails(atv21: str) -> None:
    done = ended(2, "write", atv21, "ACC=99999s", "--arm")
    assert "F803 runs" in done.stderr


def test_silent_drive_has_no_warning(atv21: str) -> None:
    assert "timeout" not in refused(3, "read", atv21, "FD01", "-d", "9", "-p", "atv21")


def test_disabled_timeout_has_no_warning() -> None:
    with tcp_line("atv21@1", "--set", "F803=0") as line:
        done = ended(0, "read", line, "FD01", "--json")
        assert (json.loads(done.stdout)["timeout"], done.stderr) == (None, "")


def test_drive_that_refuses_the_timeout_words_fails_no_command() -> None:
    with tcp_line("atv21@1", "--protect", "F803") as line:
        done = ended(0, "read", line, "FD01", "--json")
        reported = json.loads(done.stdout)["timeout"]
        assert set(reported.values()) == {None}
        assert "its communication timeout cannot be read; it may react" in done.stderr


def test_timeout_that_starts_with_a_command_is_reported_after_one() -> None:
    with tcp_line("atv71@1", "--set", "TTO=300") as line:
        done = ended(0, "read", line, "ETA", "--json")
        assert done.stderr == ""
        assert json.loads(done.stdout)["timeout"]["begun"] is None
        done = ended(5, "reset", line, "--arm")
        assert "TTO may run: it begins with the first command or reference. Aft" in done.stderr
        assert "After a trip: drivepanel reset tcp:" in done.stderr
        assert " -d 1 --arm.\n" in done.stderr
        put(line, CMD, 6)  # by another master
        done = ended(0, "read", line, "ETA", "--json")
        assert "timeout TTO runs. After 30 s without a request: Fault SLF1" in done.stderr
        assert json.loads(done.stdout)["timeout"]["begun"] is True


def test_ignored_communication_loss_has_no_warning() -> None:
    with tcp_line("atv71@1", "--set", "SLL=0") as line:
        put(line, CMD, 6)
        done = ended(0, "read", line, "ETA", "--json")
        assert done.stderr == ""
        reported = json.loads(done.stdout)["timeout"]
        assert (reported["reaction"], reported["fault"], reported["begun"]) == (
            "Ignored",
            None,
            False,
        )
        assert json.loads(ended(0, "status", line, "--json").stdout)["timeout"]["begun"] is False


def test_undocumented_reaction_is_not_reported_as_certain() -> None:
    with tcp_line("atv31@1") as line:
        output = ended(0, "read", line, "ETA").stderr
        assert "timeout ttO may run: no document states when it begins. After 10 s" in output


def test_warning_repeats_the_family_that_was_typed() -> None:
    with tcp_line("powerdrive@1", "--set", "11.63=20") as line:
        output = ended(0, "read", line, "10.40", "-p", "powerdrive").stderr
        assert f"drivepanel hold {line} -d 1 -p powerdrive." in output
        assert "timeout 11.63 may run: no document states when" in output


@pytest.mark.sweep
def test_run_warns_of_a_pending_trip_at_its_end() -> None:
    with tcp_line("atv71@1", "--set", "TTO=300") as line:
        done = drivepanel("run", line, "--reference", "10Hz", "--for", "0.5", "--arm", "--json")
        assert done.returncode == 0, done.stderr
        assert "timeout TTO runs. After 30 s without a request: Fault SLF1" in done.stderr
        reported: list[dict[str, Any]] = [json.loads(text) for text in done.stdout.splitlines()]
        last = {"seconds": 30.0, "reaction": "Freewheel", "fault": "SLF1", "begun": True}
        assert reported[-1]["timeout"] == last
        assert reported[-1]["event"] == "stopped"


@pytest.mark.parametrize("command", ["reference", "reset"])
@pytest.mark.sweep
def test_timeout_is_reported_after_commands_that_write(command: str) -> None:
    with tcp_line("atv71@1", "--set", "TTO=300") as line:
        more = ["10Hz"] if command == "reference" else []
        done = drivepanel(command, line, *more, "--arm")
        # a reset of no fault is refused, and nothing was written
        assert ("timeout TTO runs" in done.stderr) is (command == "reference")


# Holding


def in_fault(line: str) -> bool:
    return bool(held(line, STATUS_21) & 2)


@pytest.mark.sweep
def test_hold_prints_immediately_keeps_polling_and_warns_at_the_end() -> None:
    with tcp_line("atv21@1", "--set", "F803=2") as line:
        hold = (*DRIVEPANEL, "read", line, "FD01", "--hold", "6")
        with served(hold, ready="Code") as program:
            assert program.process.poll() is None, "the value comes before the end"
            _, output = program.process.communicate(timeout=PATIENCE)
        assert program.process.returncode == 0
        assert "After 2 s without a request" in output
        assert "is in fault" not in output
        assert not in_fault(line)


SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129}


@pytest.mark.parametrize("number", kept(SIGNALS, signal.SIGTERM), ids=lambda number: number.name)
@pytest.mark.sweep
def test_hold_ends_on_a_signal_with_a_warning(number: signal.Signals) -> None:
    with tcp_line("atv21@1", "atv71@2") as line:
        hold = (*DRIVEPANEL, "hold", line, "-d", "1", "-d", "2")
        with served(hold, ready="Device 2, Altivar 71: kept alive") as program:
            status, output = program.end(number)
        assert status == SIGNALS[number], output
        assert "the communication timeout gives no protection" in output
        assert "Device 1, Altivar 21: its communication timeout F803 runs. After 3 s" in output
        assert "Device 2" not in output, "nobody has commanded it"


@pytest.mark.parametrize(
    "number", kept([signal.SIGTERM, signal.SIGHUP], signal.SIGHUP), ids=lambda number: number.name
)
def test_command_ended_by_a_signal_warns_too(atv21: str, number: signal.Signals) -> None:
    with served((*DRIVEPANEL, "watch", atv21, "FD01"), ready="FD01") as program:
        status, output = program.end(number)
    assert (status, "F803 runs" in output) == (SIGNALS[number], True)


@pytest.mark.parametrize("failure", ["", "The drive refused it."])
def test_signal_during_the_warning_keeps_the_result(
    monkeypatch: pytest.MonkeyPatch, failure: str
) -> None:
    """It ended with a traceback and status 1, the answer of the command lost."""
    came: list[int] = []
    tasks: list[asyncio.Future[int]] = []
    monkeypatch.setattr("tui.cli.shared.signals.cancelled_by_signal", lambda _: nullcontext(came))

    async def interrupted(_opened: object) -> None:
        came.append(signal.SIGTERM)
        asyncio.get_running_loop().call_soon(tasks[0].cancel)
        await asyncio.sleep(PATIENCE)

    async def work() -> int:
        if failure:
            raise Failure(failure, DRIVE_REFUSED)
        return DONE

    async def command() -> int:
        tasks.append(asyncio.ensure_future(to_its_end([OpenLine.__new__(OpenLine)], work)))
        return await tasks[0]

    monkeypatch.setattr("tui.cli.shared.pending_timeouts.say_farewells", interrupted)
    if failure:
        with pytest.raises(Failure, match=failure):
            asyncio.run(command())
    else:
        assert asyncio.run(command()) == DONE
    assert came


def test_hold_prints_json() -> None:
    with tcp_line("atv21@1") as line:
        with served((*DRIVEPANEL, "hold", line, "--json"), ready='"holding"') as program:
            reported = json.loads(program.ready)
            program.end()
        assert (reported["device"], reported["event"], reported["timeout"]) == (1, "holding", ERR5)


def test_hold_reports_lost_and_absent_drives() -> None:
    with (
        tcp_line("atv21@1") as line,
        served((*DRIVEPANEL, "hold", line, "-d", "1", "-d", "9"), ready="Device 1") as program,
    ):
        lines = iter(program.process.stderr or ())
        assert any("Device 9 did not answer" in text for text in lines)
        assert program.process.poll() is None, "the others are held"


def test_hold_without_a_drive_exits_with_3() -> None:
    with tcp_line("atv21@1") as line:
        assert "protects nobody" not in refused(3, "hold", line, "-d", "9")


@pytest.mark.sweep
def test_hold_keeps_a_drive_alive_while_it_scans() -> None:
    """An address without a drive takes seconds."""
    with tcp_line("atv21@1", "--set", "F803=2") as line:
        silent = [word for device in range(10, 14) for word in ("-d", str(device))]
        hold = (*DRIVEPANEL, "hold", line, "-d", "1", *silent)
        with served(hold, ready="Device 1") as program:
            lines = iter(program.process.stderr or ())
            wait_until(lambda: "Device 13" in next(lines), "all were asked")
            assert not in_fault(line)
