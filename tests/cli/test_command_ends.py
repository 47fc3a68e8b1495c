"""Ends of commands: by Ctrl-C, by a fault that stays, by drives that do not answer."""

from __future__ import annotations

import asyncio
import importlib
import re
import signal
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import click
import msgspec
import pytest

from tui.bus.errors import LineLost
from tui.bus.link import SerialLink, TcpLink
from tui.cli.commands import bundle, hold, listen, prove, run
from tui.cli.shared.errors import Failure
from tui.cli.shared.options import Target
from tui.drive.finding import LineSetting
from tui.session.bundle.parts import Missing

from .commands import invoked

COMMANDS = "tui.cli.commands"
single_orders, scan = (
    importlib.import_module(f"{COMMANDS}.{name}") for name in ("single_orders", "scan")
)

# Ctrl-C


NOTHING = "Ended by Ctrl-C: nothing was written."
ENDED = {
    ("watch", "L", "ACC"): ("watch.on_line", "Ended by Ctrl-C after 0 cycles."),
    ("watch", "L", "ACC", "--csv", "x.csv"): (
        "watch.on_line", "Ended by Ctrl-C after 0 cycles; 0 rows written to x.csv.",
    ),
    ("record", "L", "ACC", "--out", "x.sqlite"): ("record.on_line", "Ended by Ctrl-C."),
    ("backup", "L", "x.toml"): ("backup.set_of_drive", NOTHING),
    ("backup", "L", "x.toml", "--recipe"): ("backup.on_line", NOTHING),
    ("report", "L", "x.md"): ("report.set_of_drive", NOTHING),
    ("scan", "L"): ("scan.on_line", "Ended by Ctrl-C. Nothing was sent."),
}  # fmt: skip
"""By the words: the function that Ctrl-C ends, and the error."""


@pytest.mark.parametrize("words", ENDED, ids=" ".join)
def test_ctrl_c_ends_a_command_with_its_result(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ended(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    place, text = ENDED[words]
    monkeypatch.setattr(f"{COMMANDS}.{place}", ended)
    done = invoked(*(word.replace("L", "sim:atv71") if word == "L" else word for word in words))
    assert (done.exit_code, done.stdout) == (130, "")
    assert done.stderr == f"drivepanel: {text}\n"
    assert [path for path in tmp_path.iterdir() if path.name.startswith("x")] == []


# A run


@pytest.mark.parametrize("fails", [False, True])
async def test_run_goes_through_all_its_parts(fails: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    ended = asyncio.Event()

    class Ending:
        @contextmanager
        def by_signals(self) -> Iterator[None]:
            calls.append("signals")
            yield

        def end(self, why: str) -> None:
            calls.append(why)
            ended.set()

    class MotorRun:
        def __init__(self, *parts: Any, **how: Any) -> None:
            names = {"prepare", "command"}
            calls.append([part if isinstance(part, str) else type(part) for part in parts])
            calls.append({name: item for name, item in how.items() if name not in names})
            calls.append([how[name].__name__ for name in sorted(names)])

        async def carry_out(self) -> None:
            await ended.wait()
            if fails:
                raise Failure("Not started.", 4)

    class Output:
        def __init__(self, gone: Callable[[], None]) -> None:
            gone()
            self.say = "say"

        def finish(self) -> None:
            calls.append("finished")

    starts: list[Any] = []

    def keeper(name: str) -> Any:
        starts.append(SimpleNamespace(name=name))
        return starts[0]

    @asynccontextmanager
    async def watched(*given: Any) -> AsyncIterator[tuple[Any, Any]]:
        calls.append(given)
        yield "fleet", SimpleNamespace(session="session")

    monkeypatch.setattr("tui.session.running.ending.Ending", Ending)
    monkeypatch.setattr("tui.session.running.motor_run.MotorRun", MotorRun)
    monkeypatch.setattr("tui.session.starts.keeper.StartKeeper", keeper)
    monkeypatch.setattr(run, "BufferedOutput", Output)
    monkeypatch.setattr(run, "watched", watched)
    wish = run.RunOptions("forward", None, 3.0, True, True, False)
    running = run.run_motor(cast(Any, "opened"), cast(Any, "target"), wish)
    if fails:
        with pytest.raises(Failure, match="Not started"):
            await running
    else:
        await running
    (starting,) = starts
    assert vars(starting) == {"name": "run", "unrecorded": True, "left_running": True}
    assert calls == [
        "signals",
        ("opened", "target", starting),
        ["fleet", SimpleNamespace, Ending, run.RunTelling],
        {"by": "drivepanel run", "seconds": 3.0, "leave_running": True},
        ["give", "prepare"],
        "its output is no longer read",
        "finished",
    ]


# A reset


CYCLES: dict[str, tuple[list[tuple[float, str, str]], str, int]] = {
    "out of its fault": ([(9, "", "ready"), (11, "", "fault"), (12, "", "ready")], "", 0),
    "not read yet": ([(11, "", "unknown"), (12, "", "starting"), (12.5, "", "blocked")], "", 0),
    "an error in between": ([(11, "Lost.", "ready"), (13, "", "ready")], "", 0),
    "in its fault": (
        [(11, "", "fault"), (13, "", "fault"), (13.1, "", "fault")],
        "The drive stays in FAULT: its cause is not gone. Check the machine.", 4,
    ),
    "no answer": ([(11, "", "fault"), (13.1, "Lost.", "ready")], "Lost.", 3),
    "at the terminals": ([(13.1, "", "fault")], "Not in command.", 4),
}  # fmt: skip
"""By name: time, error and state of each cycle after a reset at 10 s; the refusal; its status."""


@pytest.mark.parametrize("name", CYCLES)
async def test_drive_leaves_its_fault_within_its_time(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cycles, text, status = CYCLES[name]
    left = iter(cycles)

    def latest(_: object) -> Any:
        time, error, kind = next(left)
        return SimpleNamespace(
            time=time, error=error, state=SimpleNamespace(kind=kind, headline=kind.upper())
        )

    why = text if name == "at the terminals" else ""
    monkeypatch.setattr(single_orders, "latest_of", latest)
    monkeypatch.setattr(single_orders, "patience", lambda line, seconds: seconds)
    monkeypatch.setattr(single_orders, "not_in_command", lambda *_: why)
    monkeypatch.setattr(single_orders, "COMMAND_POLL_INTERVAL", 0.0)
    waiting = single_orders._out_of_fault(Mock(), SimpleNamespace(time=10.0))
    if text:
        with pytest.raises(Failure) as failed:
            await waiting
        assert (failed.value.message, failed.value.status) == (text, status)
    else:
        await waiting
    assert next(left, None) is None


# Other commands


@pytest.mark.parametrize(
    ("link", "others", "every", "text"),
    [
        (SerialLink("/dev/x"), [], False, ""),
        (TcpLink("h"), [], False, ""),
        (TcpLink("h"), [], True, "--all-settings is for serial ports: this line has no baud."),
        (SerialLink("/dev/x"), ["panel", "serve"], True,
         "--all-settings needs the line for itself, and panel, serve uses it. Nothing was sent."),
        (SerialLink("/dev/x"), [], True, ""),
    ],
)  # fmt: skip
async def test_settings_of_a_scan(
    link: Any, others: list[str], every: bool, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Any] = []
    here, more = LineSetting(19200, "8E1"), [LineSetting(19200, "8E1"), LineSetting(9600, "8E1")]

    def worth(*words: Any, **how: Any) -> Any:
        given.append((*words, how))
        return more

    def estimate(*words: Any, **how: Any) -> str:
        given.append((*words, how))
        return "costs"

    monkeypatch.setattr("tui.session.connect.address_prober.settings_worth_a_try", worth)
    monkeypatch.setattr("tui.session.connect.scan_estimate.scan_estimate", estimate)
    monkeypatch.setattr("tui.bus.transport.ports.is_pseudo_terminal", lambda path: path == "/dev/y")
    line = Mock(link=link)
    line.facts.others = [SimpleNamespace(text=name) for name in others]
    line.timing.scan_timeout = 0.1
    item = SimpleNamespace(
        opened=SimpleNamespace(line=line, simulation=None), devices=[1, 2, 3], settings=None,
        setting=here if isinstance(link, SerialLink) else None, costs=None,
    )  # fmt: skip
    if text:
        kind = Failure if others else click.UsageError
        with pytest.raises(kind, match=f"^{re.escape(text)}$"):
            await scan._prepare(item, all_settings=every)
        return
    await scan._prepare(item, all_settings=every)
    if every:
        assert (item.settings, item.costs) == (more, "costs")
        assert given == [(here, {"parity": True}), (link, 0.1, more, 3, {"patient": False})]
    else:
        assert item.settings == ([here] if isinstance(link, SerialLink) else [])


@pytest.mark.parametrize("answer", [True, False])
async def test_proof_on_the_run_is_confirmed(
    answer: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    questions: list[str] = []

    async def answered(question: str) -> bool:
        questions.append(question)
        return answer

    monkeypatch.setattr(prove, "may_ask", lambda: True)
    monkeypatch.setattr(prove, "says_yes", answered)
    if answer:
        await prove._ask_on_the_run(4)
    else:
        with pytest.raises(Failure, match=r"^Nothing was proved\.$") as failed:
            await prove._ask_on_the_run(4)
        assert failed.value.status == 5
    assert questions == ["Prove the communication loss of device 4 on the run?"]
    assert capsys.readouterr().err == f"drivepanel: {prove.ON_THE_RUN}\n"


async def test_held_drive_must_have_answered(monkeypatch: pytest.MonkeyPatch) -> None:
    async def connects(*given: Any) -> Any:
        return given

    monkeypatch.setattr(hold, "connect_drive", connects)
    opened, target = Mock(), Target("L", 7, None)
    opened.line.device_state.return_value.heard = 1.0
    found: Any = await hold._connected(opened, target)
    assert found == (opened, target)
    opened.line.device_state.assert_called_once_with(7)
    opened.line.device_state.return_value.heard = None
    with pytest.raises(Failure, match=r"^Device 7 does not answer\.$") as failed:
        await hold._connected(opened, target)
    assert failed.value.status == 3


def test_events_of_held_drives(capsys: pytest.CaptureFixture[str]) -> None:
    hold._teller("lost", 4, "No reply.")
    assert capsys.readouterr().out[8:] == "  No reply.\n"
    hold._json_teller("pump")("lost", 4, "No reply.")
    found = msgspec.json.decode(capsys.readouterr().out)
    assert found.pop("time").startswith("20")
    assert found == {
        "schema": 1, "command": "hold", "line": "pump", "device": 4, "event": "lost",
        "text": "No reply.",
    }  # fmt: skip


async def test_drive_of_a_bundle_is_opened_by_its_expected_profile(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given: list[Target] = []

    async def connects(_: object, target: Target) -> Any:
        given.append(target)
        if target.profile_id is None:
            raise click.UsageError("It does not identify itself.")
        return "session"

    monkeypatch.setattr(bundle, "connect_drive", connects)
    remembered = "tui.session.diagnosis.asking.profile_remembered"
    monkeypatch.setattr(remembered, lambda link, device: SimpleNamespace(id=f"{link}-{device}"))
    opened = cast(Any, "opened")
    named: Any = bundle._subject(Target("L", 1, "atv71"), (4,), opened, None)
    assert await named.open_drive(4) == "session"
    known: Any = bundle._subject(Target("L", 1, None), (4,), opened, cast(Any, "link"))
    assert await known.open_drive(5) == "session"
    assert [(item.device, item.profile_id) for item in given] == [
        (4, None), (4, "atv71"), (5, None), (5, "link-5"),
    ]  # fmt: skip
    nameless = bundle._subject(Target("L", 1, None), (4,), opened, None)
    with pytest.raises(Missing, match="It does not identify itself"):
        await nameless.open_drive(4)
    assert (named.text, named.link, named.opened, named.devices) == ("L", None, "opened", (4,))


@pytest.mark.parametrize(
    ("error", "came", "status", "text"),
    [
        (None, 0, 0, "Heard."),
        (KeyboardInterrupt(), 0, 130, "drivepanel: Ended by Ctrl-C. Heard.\n"),
        (KeyboardInterrupt(), signal.SIGTERM, 143, "drivepanel: Ended by SIGTERM. Heard.\n"),
        (LineLost("Cut."), 0, 3, "drivepanel: Cut.\n"),
    ],
)
def test_end_of_listening(
    error: BaseException | None,
    came: int,
    status: int,
    text: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls: list[Any] = []

    class Run:
        text = "Heard."

        def __init__(self, *_: Any) -> None:
            pass

        def run(self, *given: Any) -> None:
            calls.append(given)
            if error is not None:
                raise error

        def end(self) -> None:
            calls.append("ended")

    @contextmanager
    def place(*given: Any) -> Iterator[Any]:
        calls.append(given)
        line = SimpleNamespace(link=SerialLink("/dev/x"))
        yield SimpleNamespace(line=line, begin=lambda: calls.append("begun"))

    @contextmanager
    def interrupted() -> Iterator[list[int]]:
        yield [came] if came else []

    monkeypatch.setattr(listen, "HearingRun", Run)
    monkeypatch.setattr(listen, "line_to_listen", place)
    monkeypatch.setattr(listen, "interrupted_by_signal", interrupted)
    done = invoked("listen", "serial:/dev/x", "--for", "3", "--every", "1")
    assert calls == [("serial:/dev/x", "listen"), "begun", (3.0, 1.0), "ended"]
    begin = "Listening at /dev/x; nothing is sent. Ctrl-C ends it.\n"
    assert done.stdout == begin + ("" if error else f"{text}\n")
    assert (done.exit_code, done.stderr) == (status, text if error else "")
