"""Parts of commands without a line: their complete texts, documents and effects."""

from __future__ import annotations

import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock, Mock

import click
import pytest

from tui.cli.commands import block, hold, run, watch
from tui.cli.shared.errors import Failure
from tui.cli.shared.options import Target
from tui.drive.profile import library
from tui.session.timeout_report import Timeout, TimeoutWatch

COASTS = cast(Any, SimpleNamespace(does="Fault SLF1, the motor coasts."))


@pytest.mark.parametrize(
    ("found", "text"),
    [
        (Timeout(False), "its communication timeout cannot be read; it is polled often."),
        (Timeout(True), "its communication timeout is off or does not exist; it is polled anyway."),
        (Timeout(True, TimeoutWatch(2.5, None)),
         "kept alive within its communication timeout of 2.5 s."),
        (Timeout(True, TimeoutWatch(10, COASTS)),
         "kept alive within its communication timeout of 10 s (Fault SLF1, the motor coasts)."),
    ],
)  # fmt: skip
def test_reaction_that_is_prevented_is_named(found: Timeout, text: str) -> None:
    session = cast(Any, SimpleNamespace(device=3, profile=SimpleNamespace(name="Altivar 71")))
    assert hold.held_text(session, found) == f"Device 3, Altivar 71: {text}"


async def held(missing: int, devices: list[int], monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Reports on drives that are to be kept polled; the first ones do not answer."""
    reports: list[Any] = []
    profile = library.load("atv71")

    async def connected(_: object, target: Target) -> Any:
        if target.device <= missing:
            raise Failure(f"Device {target.device} does not answer.", 3)
        return SimpleNamespace(device=target.device, profile=profile)

    monkeypatch.setattr(hold, "_connected", connected)
    monkeypatch.setattr(hold, "complain", reports.append)
    monkeypatch.setattr("tui.session.monitor.timeout.timeout_now", lambda _: Timeout(False))
    fleet = SimpleNamespace(found=[])
    holding = SimpleNamespace(fleet=fleet, take=fleet.found.append)
    targets = [Target("L", device, None) for device in devices]
    await hold._take_all(cast(Any, None), targets, cast(Any, holding), lambda *e: reports.append(e))
    return reports


async def test_drives_that_answer_are_kept_polled(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "Device {}, Altivar 71: its communication timeout cannot be read; it is polled often."
    assert await held(1, [1, 2, 3], monkeypatch) == [
        "Device 1 does not answer.", hold.DISARMS,
        ("holding", 2, text.format(2), Timeout(False)),
        ("holding", 3, text.format(3), Timeout(False)),
    ]  # fmt: skip
    for devices in ([1], [1, 2]):
        with pytest.raises(Failure, match=f"Device {devices[-1]} does not answer"):
            await held(2, devices, monkeypatch)


# Blocks


@pytest.mark.parametrize(
    ("sent", "text"),
    [
        ({"A": True, "B": True}, "Slots written and verified: A, B."),
        ({"A": True, "B": False, "C": False},
         "Slots written and verified: A. B, C may have been written too: look at it."),
        ({"A": False},
         "Slots written and verified: none. A may have been written too: look at it."),
    ],
)  # fmt: skip
def test_slots_of_a_write_that_was_cut_are_named(sent: dict[str, bool], text: str) -> None:
    assert block._cut_short(sent) == text


@pytest.mark.parametrize(
    ("direction", "trouble", "verdicts", "status"),
    [
        ("read", "", ["same", "moving", "unused", "not compared"], 0),
        ("read", "", ["same", "differs"], 1),
        ("read", "", ["changed meanwhile"], 1),
        ("read", "", ["no value", "same"], 1),
        ("read", "No reply.", ["same"], 1),
        ("write", "No reply.", ["differs", "no value"], 0),
    ],
)
def test_status_of_a_comparison(
    direction: str, trouble: str, verdicts: list[str], status: int
) -> None:
    slots = [SimpleNamespace(verdict=verdict) for verdict in verdicts]
    good = SimpleNamespace(block=SimpleNamespace(direction="read"), trouble="", slots=[])
    view = SimpleNamespace(block=SimpleNamespace(direction=direction), trouble=trouble, slots=slots)
    assert block._status(cast(Any, [good, view, good])) == status


# A run


class Given:
    """A commander that takes commands, and what is reported of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **options: Any) -> None:
        self.calls: list[Any] = []
        commander = Mock(given=SimpleNamespace(reference_text="Reference 20.0 Hz (LFR)"))
        for name in ("run", "check_run", "order"):
            getattr(commander, name).side_effect = lambda *w, n=name: self.calls.append((n, *w))
        console = Mock(commander=commander)
        console.session.profile.name = "Altivar 71"

        async def carried(_: object, give: Any) -> Any:
            give()
            return SimpleNamespace(text="Run forward: running.")

        monkeypatch.setattr(run, "carried_out", carried)
        monkeypatch.setattr(run, "arm_drive", lambda item: self.calls.append(item is console))
        made = {"order": "reverse", "reference": "20Hz", "seconds": None, "leave_running": False,
                "unrecorded": False, "as_json": False, "take_control": False}  # fmt: skip
        wish = run.RunOptions(**{**made, **options})
        telling = Mock(report=lambda *words: self.calls.append(words))
        self.command = run.RunCommand(console, wish, telling)


async def test_run_is_armed_and_given_with_its_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    given = Given(monkeypatch)
    await given.command.prepare()
    await given.command.give()
    assert given.calls == [
        True, ("run", "reverse", "20Hz"), ("reference", "Reference 20.0 Hz (LFR)"),
        ("order", "Run forward: running."),
    ]  # fmt: skip
    given = Given(monkeypatch, reference=None)
    await given.command.give()
    assert given.calls == [("run", "reverse", None), ("order", "Run forward: running.")]


@pytest.mark.parametrize("taken", [None, False, True])
async def test_control_is_taken_before_a_run(
    taken: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = Given(monkeypatch, take_control=True)
    found = SimpleNamespace(can_take=taken is not None, taken=taken)
    monkeypatch.setattr(run, "taking_of", lambda _: found)
    if taken is None:
        text = "Altivar 71 has no control to take: run without that option."
        with pytest.raises(Failure, match=text) as failed:
            await given.command.prepare()
        assert failed.value.status == 5
        return
    await given.command.prepare()
    text = (
        "Run forward: running.. It stays with the line after this: stop --give-back --arm gives it"
        " back."
    )
    done = [("check_run", "reverse", "20Hz"), ("order", "take-control"), ("control", text)]
    assert given.calls == [True, *(() if taken else done)]


@pytest.mark.parametrize("way", ["", "run --take-control takes the control first."])
async def test_run_that_is_refused_names_the_way(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given = Given(monkeypatch)
    monkeypatch.setattr(run, "carried_out", AsyncMock(side_effect=Failure("Refused.", 4)))
    monkeypatch.setattr(run, "way_to_take", lambda _: way)
    with pytest.raises(Failure) as failed:
        await given.command.give()
    assert (failed.value.message, failed.value.status) == (f"Refused. {way}".rstrip(), 4)
    assert given.calls == []


# Watch


CSV = Path("x.csv")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ((None, False, False, None), ""),
        ((CSV, False, False, "day"), ""),
        ((CSV, True, False, None), ""),
        ((Path("-"), False, True, None), ""),
        ((None, True, False, None), "--append, --force and --rotate require --csv FILE."),
        ((None, False, True, None), "--append, --force and --rotate require --csv FILE."),
        ((None, False, False, 100), "--append, --force and --rotate require --csv FILE."),
        ((CSV, True, True, None), "Either --append or --force."),
        ((Path("-"), True, False, None),
         "--append and --rotate require --csv FILE, not standard output."),
        ((Path("-"), False, False, 100),
         "--append and --rotate require --csv FILE, not standard output."),
    ],
)  # fmt: skip
def test_options_of_a_csv_file(options: tuple[Any, ...], text: str) -> None:
    expected = pytest.raises(click.UsageError, match=f"^{re.escape(text)}$")
    with expected if text else nullcontext():
        watch.CsvOptions(*options).check()


def test_end_of_watching_is_summarized() -> None:
    seen = watch.CyclesSeen(cycles=7)
    assert seen.at_the_end(watch.CsvOptions(None, False, False, None)) == (
        "Ended by Ctrl-C after 7 cycles."
    )
    wish = watch.CsvOptions(CSV, False, False, None)
    text = "Ended by Ctrl-C after 7 cycles; {} rows written to x.csv."
    assert seen.at_the_end(wish) == text.format(0)
    wish.file = cast(Any, SimpleNamespace(rows=6))
    assert seen.at_the_end(wish) == text.format(6)


@pytest.mark.parametrize(
    ("errors", "silent"),
    [(["", ""], ""), (["a", "b"], "a"), (["a", ""], ""), (["a", "", "b", "c"], "b")],
)
async def test_first_of_a_row_of_errors_is_reported_at_the_end(
    errors: list[str], silent: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Any] = []
    left = iter([SimpleNamespace(error=error) for error in errors])

    class Monitor:
        def __init__(self, session: Any) -> None:
            calls.append(session)

        def listen(self, take: Any) -> Any:
            calls.append(take)
            return lambda: calls.append("left")

        def start(self, *given: Any) -> None:
            calls.append(given)

        def stop(self) -> None:
            calls.append("stopped")

    class Cycles:
        take = "take"

        def __init__(self, *given: Any) -> None:
            calls.append(given)

        async def next(self) -> Any:
            return next(left)

    monkeypatch.setattr("tui.session.monitor.monitor.Monitor", Monitor)
    monkeypatch.setattr("tui.cli.shared.cycles.Cycles", Cycles)
    drive, seen, taken = Mock(session="S", codes=["ACC"]), watch.CyclesSeen(), list[Any]()
    outputs: Any = [SimpleNamespace(take=lambda *given: taken.append(given))] * 2
    await watch._follow(drive, 0.5, len(errors), outputs, seen)
    assert calls == [("S", ["ACC"]), "S", "take", (["ACC"], 0.5), "left", "stopped"]
    assert [item[1].error for item in taken] == [error for error in errors for _ in range(2)]
    assert all(item[0] is drive for item in taken)
    assert (seen.cycles, seen.silent) == (len(errors), silent)
