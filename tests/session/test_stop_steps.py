"""Steps of a stop without a wire: its words, what it reads for them, and who runs the motor."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.drive.channel import Channel
from tui.drive.orders import choose, stop_in_any
from tui.drive.profile import library
from tui.session.command import last_known, motor_stop
from tui.session.command.first_stop import ONE_WORD
from tui.session.command.last_known import run_by_others
from tui.session.command.motor_stop import FirstWave, MotorStop
from tui.session.command.stop_report import Phase, not_proved, not_stopped
from tui.session.connect.limits import limits_of
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.settings.write import Writer

from .test_stop_followed import (
    COMMAND,
    HERTZ,
    PROFILE,
    RUNNING,
    STATUS,
    SWITCHED_ON,
    OneStop,
    OwnTime,
    Ramp,
    journal,
    turns,
)

__all__ = ["journal"]
CHART = PROFILE.data.charts[0]
ENABLED_STILL, TURNS = "it is at 0 Hz and still enabled", "a reference turns it at once."
RAMP_STOP = choose(CHART, "stop", {})


class Watched(Ramp):
    """A drive that notes the priority of each read, and the options of each write."""

    def __init__(self) -> None:
        super().__init__(OwnTime(), 0.0)
        self.priorities: list[Priority] = []
        self.how: list[dict[str, Any]] = []

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.priorities.append(priority)
        await super().before_read(device, registers, priority)

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        self.how.append(how)
        return await super().write(device, address, values, **how)


async def test_word_of_a_stop_has_the_priority_of_stops_and_is_in_the_journal(
    journal: Journal,
) -> None:
    drive = Watched()
    here = OneStop(drive, journal)
    await here.stop._send(CHART, RAMP_STOP, within=0.1)
    assert [(how["priority"], how["within"]) for how in drive.how] == [(Priority.STOP, 0.1)]
    assert [entry.why for entry in journal.recent] == ["stopped: Ramp stop"]


async def test_conditions_of_a_stop_are_read_with_the_priority_of_stops(journal: Journal) -> None:
    drive = Watched()
    here = OneStop(drive, journal)
    await here.stop._read_anew(["CHCF", "ETA", "CHCF"])
    assert set(drive.priorities) == {Priority.STOP}
    drive.priorities.clear()
    await here.stop._motion(CHART)
    assert set(drive.priorities) == {Priority.OPERATOR_READ}, "a stop of another drive is first"
    before = len(drive.priorities)
    await here.stop._read_anew(["CHCF"])
    assert len(drive.priorities) == before, "just read"


@pytest.mark.parametrize("known", [True, False])
async def test_stop_of_a_drive_that_cannot_be_read_is_by_what_is_certain(
    known: bool, journal: Journal, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    any_chart = object()

    async def silent(*_: object) -> None:
        raise NoAnswer(1, 3, 3201)

    def in_force(profile: object, raws: object) -> Any:
        assert (profile, raws) == (PROFILE, {})
        return CHART if known else None

    monkeypatch.setattr(motor_stop, "chart_in_force", in_force)
    monkeypatch.setattr(motor_stop.MotorStop, "_read_anew", silent)
    monkeypatch.setattr(motor_stop, "stop_in_any", lambda *of: (any_chart, *of))
    found = cast(Any, await here.stop._chosen())
    if known:
        assert found == (CHART, RAMP_STOP)
        assert "stop of device 1 without a read: " in caplog.text
    else:
        assert found == (any_chart, PROFILE, {})


async def test_drive_leaves_a_wave_as_soon_as_its_word_is_sent(journal: Journal) -> None:
    waiting: list[str] = []

    class Wave(FirstWave):
        def passed(self, device: int) -> None:
            waiting.append(f"passed {device}")

        async def over(self) -> None:
            waiting.append("over")

    here = OneStop(Ramp(OwnTime(), 0.0), journal, wave=Wave([1, 2]))
    assert await here.stop.carry_out() is None
    assert waiting == ["passed 1", "over"]


def test_value_that_is_in_doubt_is_not_certain(journal: Journal) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    here.session.image.confirm("CHCF", 1, 999.0)
    here.session.image.distrust()
    here.session.image.confirm("ETA", RUNNING, 1000.0)
    assert here.stop._sure(["CHCF"]) == {}


def run_by(here: OneStop, channel: Channel | None, local: bool, monkeypatch: Any) -> str:
    monkeypatch.setattr(last_known, "command_channel", lambda *_: channel)
    state = SimpleNamespace(motion="running", local=local)
    return run_by_others(cast(Any, SimpleNamespace(
        state=lambda _: state, profile=PROFILE, image=here.session.image
    )))  # fmt: skip


STOP_THERE = "not Modbus. Stop it there or at the machine."


@pytest.mark.parametrize(
    ("channel", "local", "text"),
    [
        (None, False, ""),
        (None, True, f"its terminals or keypad run the motor, {STOP_THERE}"),
        (Channel("the keypad", False), False, f"its command source is the keypad, {STOP_THERE}"),
        (Channel("the keypad", False, PROFILE["CHCF"]), True,
         f"its command source is the keypad (CHCF), {STOP_THERE}"),
        (Channel("Modbus", True), False, ""),
        (Channel("", False), False, ""),
    ],
)  # fmt: skip
def test_source_that_runs_a_motor_is_named_with_its_word(
    channel: Channel | None, local: bool, text: str, journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    assert run_by(here, channel, local, monkeypatch) == text


async def test_stop_of_a_motor_that_another_source_runs_is_reported_as_unheeded(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, "run_by_others", lambda _: "the keypad runs it.")
    await here.stop._send(CHART, RAMP_STOP)
    assert here.reports == [(Phase.UNHEEDED, not_stopped("the keypad runs it."), 1000.0)]
    assert here.written == [7], "it may obey anyway"
    await turns()


async def test_word_keeps_option_bits_only_of_a_known_word(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, "with_options", lambda chart, order, kept: [kept.get("CMD", 5)])
    await here.stop._send(CHART, RAMP_STOP)
    here.session.image.confirm("CMD", 0x0800, 1001.0)
    await here.stop._send(CHART, RAMP_STOP)
    await here.stop._send(CHART, RAMP_STOP)
    assert here.written == [5, 0x0800, 0x0800], "the word before the stop"
    assert PROFILE["CMD"].address == COMMAND


class Passed(FirstWave):
    """A wave that notes which drives have passed it."""

    def __init__(self) -> None:
        super().__init__([1, 2])
        self.devices: list[int] = []

    def passed(self, device: int) -> None:
        self.devices.append(device)


FAMILIES: Any = [SimpleNamespace(id="one"), SimpleNamespace(id="another")]


@pytest.mark.parametrize(
    ("sent", "taken", "answered", "why"),
    [
        (True, "word", True, None), (True, None, True, "it took no stop word."),
        (True, None, False, "it did not answer."), (False, None, False, "it did not answer."),
    ],
)  # fmt: skip
async def test_drive_of_unlike_families_is_sent_the_word_that_stops_them_all(
    sent: bool, taken: object, answered: bool, why: str | None, journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    wave, calls = Passed(), []
    here = OneStop(Ramp(OwnTime(), 0.0), journal, wave=wave)
    here.session.image.confirm("CHCF", 1, 999.0)

    async def first(*of: object) -> Any:
        calls.append(of)
        here.drive.describe(1, ONE_WORD)
        return SimpleNamespace(sent=(1,) * sent, taken=taken, answered=answered)

    monkeypatch.setattr(motor_stop, "unlike_families", lambda _: FAMILIES)
    monkeypatch.setattr(motor_stop, "stop_first", first)
    assert await here.stop.carry_out() == why
    assert calls == [(here.drive, 1, journal, FAMILIES, ["one", "another"], "stop")]
    assert (here.drive.limits[1], wave.devices) == (limits_of(PROFILE), [1])
    assert (here.stop.begun, here.stop.sent, here.stop.taken) == (True, sent, bool(taken))
    assert here.session.reported_by_line
    assert here.reports == ([(Phase.FAILED, not_proved(), 1000.0)] if taken else [])
    assert ("CHCF" in here.session.image.trusted) is not bool(taken)
    assert here.written == []


async def test_drive_of_unlike_families_that_fails_does_not_hold_up_the_others(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    wave = Passed()
    here = OneStop(Ramp(OwnTime(), 0.0), journal, wave=wave)

    async def first(*_: object) -> None:
        here.drive.describe(1, ONE_WORD)
        raise NoAnswer(1, 3, 1)

    monkeypatch.setattr(motor_stop, "unlike_families", lambda _: FAMILIES)
    monkeypatch.setattr(motor_stop, "stop_first", first)
    with pytest.raises(NoAnswer):
        await here.stop.carry_out()
    assert (here.drive.limits[1], wave.devices) == (limits_of(PROFILE), [1])
    assert await here.stop.follow() is None
    assert here.reports == [(Phase.FAILED, not_proved(), 1000.0)]
    assert here.stop.sent, "in another way"


# -- what follows the word -------------------------------------------------------------------------

ATV71 = library.load("atv71")


class Halting(Ramp):
    """An Altivar 71 that ramps down at its halt, and stays enabled until its last word."""

    def __init__(self, **held: int) -> None:
        super().__init__(OwnTime(), 0.0)
        self.registers.update({ATV71[code].address: raw for code, raw in held.items()})

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        if self.stopped_at is not None:
            self.registers[HERTZ] = max(0, self.registers[HERTZ] - 1000)

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        if list(values) == [7]:
            assert self.registers[HERTZ] == 0, "a shutdown would let the motor coast"
            self.registers[STATUS] = SWITCHED_ON
        return await super().write(device, address, values, **how)


def stop_of_71(journal: Journal, **held: int) -> OneStop:
    here = OneStop(Halting(**held), journal)
    here.session = DriveSession(here.drive, 1, ATV71, clock=here.drive.clock)
    writer = Writer(here.session, journal, None)
    here.stop = MotorStop(here.session, writer, "stop", 1000.0, here.stop.say)
    return here


@pytest.mark.parametrize(
    ("chcf", "dotd", "words"), [(1, 0, [0x10F]), (1, 1, [7]), (3, 0, [0]), (9, 0, None)]
)
async def test_words_of_a_stop_are_selected_by_what_the_drive_holds(
    chcf: int, dotd: int, words: list[int] | None, journal: Journal
) -> None:
    here = stop_of_71(journal, CHCF=chcf, DOTD=dotd)
    _, order = await here.stop._chosen()
    assert list(order.words) == (words or list(stop_in_any(ATV71, {})[1].words))


async def test_motor_that_a_halt_has_stopped_gets_the_word_that_ends_operation(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    checked: list[object] = []

    async def check(reader: object, priority: Priority) -> None:
        checked.append((reader, priority))

    monkeypatch.setattr(motor_stop, "check_byte_order", check)
    here = stop_of_71(journal, CHCF=1)
    assert await here.stop.carry_out() is None
    assert here.written == [0x10F, 7]
    assert [text for *_, text, _ in here.reports] == [
        "Halt", "Halt, 200 Hz", "Halt, 100 Hz", "Ramp stop", "stopped",
    ]  # fmt: skip
    assert checked == [(here.stop.reader, Priority.OPERATOR_READ)]
    assert here.session.full_reads_requested > 0


async def test_stop_that_another_has_replaced_reports_nothing_more(journal: Journal) -> None:
    """Its acknowledgment may arrive after the reports of the other one."""
    here = stop_of_71(journal, CHCF=1)
    here.stop.over = True
    await here.stop._send(*await here.stop._chosen())
    assert here.written == [0x10F]
    assert here.reports == []


Moves = list[tuple[str, float | None]]


async def follow(here: OneStop, moves: Moves, monkeypatch: pytest.MonkeyPatch) -> str | None:
    """The result of a stop whose motor moves so; the last entry repeats."""
    seen = iter(moves)

    async def motion(_: object, chart: object) -> tuple[str, float | None]:
        return next(seen, moves[-1])

    monkeypatch.setattr(MotorStop, "_motion", motion)
    monkeypatch.setattr(motor_stop, "STANDSTILL_POLL_INTERVAL", 0.25)
    return await here.stop._follow(CHART, RAMP_STOP)


async def test_motor_is_reported_as_run_by_others_only_while_it_runs(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, "run_by_others", lambda _: "the keypad runs it.")
    moves: Moves = [("running", 30.0), ("stopping", 20.0), ("unknown", None), ("stopped", None)]
    before = here.session.full_reads_requested
    assert await follow(here, moves, monkeypatch) is None
    assert [report[:2] for report in here.reports] == [
        (Phase.UNHEEDED, not_stopped("the keypad runs it.")), (Phase.STOPPING, "Ramp stop, 20 Hz"),
        (Phase.STOPPING, "Ramp stop"), (Phase.STOPPED, "stopped"),
    ]  # fmt: skip
    assert here.drive.clock.now == 1000.75
    assert here.session.full_reads_requested == before + 1
    assert here.stop._unheeded is False


async def test_motor_of_unknown_frequency_stands_only_once_its_state_says_so(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    moves: Moves = [("stopping", 20.0), ("stopping", None), ("stopping", None), ("stopped", None)]
    assert await follow(here, moves, monkeypatch) is None
    assert [phase for phase, *_ in here.reports] == [Phase.STOPPING] * 3 + [Phase.STOPPED]
    monkeypatch.setattr(motor_stop, "STOP_FOLLOWED_FOR", 1.0)
    for hertz, text in (
        (None, motor_stop.STANDSTILL_UNKNOWN),
        (1.0, motor_stop.STILL_TURNS),
        (0.0, None),
    ):
        here.stop.ordered = here.drive.clock.now
        assert await follow(here, [("stopping", hertz)], monkeypatch) == text


@pytest.mark.parametrize(
    ("constant", "seconds", "moves", "ends"),
    [
        ("STOP_FOLLOWED_FOR", 1.0, [("stopping", 1.0)], 1001.0),
        ("STOP_FOLLOWED_FOR", 1.0, [("stopping", None)], 1001.0),
        ("TAKES_EFFECT", 0.5, [("running", 30.0)], 1000.75),
        ("TAKES_EFFECT", 0.5, [("running", None)], 1000.75),
        ("TAKES_EFFECT", 0.5, [("running", 0.0)], 1000.75),
    ],
)
async def test_motor_is_followed_for_its_time_and_no_longer(
    constant: str, seconds: float, moves: Moves, ends: float, journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, constant, seconds)
    assert await follow(here, moves, monkeypatch)
    assert here.drive.clock.now == ends


@pytest.mark.parametrize(
    ("hertz", "local", "channel", "others", "text"),
    [
        (30.0, False, "", "the keypad runs it.", "the keypad runs it."),
        (0.0, False, "", "the keypad runs it.", f"{ENABLED_STILL} by another source: {TURNS}"),
        (0.0, True, "x", "", f"{ENABLED_STILL} from its terminals or keypad: {TURNS}"),
        (0.0, False, "by CANopen", "", f"{ENABLED_STILL} by CANopen: {TURNS}"),
        (30.0, True, "x", "", "it answers and runs on; it is commanded from its terminals or"
         " keypad."),
        (None, False, "by CANopen", "", "it answers and runs on; it is commanded by CANopen."),
        (30.0, False, "", "", "it answers and runs on; it is commanded by another source."),
    ],
)  # fmt: skip
def test_reason_of_a_motor_that_does_not_stop_names_the_source_of_its_commands(
    hertz: float | None, local: bool, channel: str, others: str, text: str, journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, "run_by_others", lambda _: others)
    monkeypatch.setattr(
        DriveSession, "state", lambda *_: SimpleNamespace(local=local, channel=channel)
    )
    assert here.stop._why_not(hertz) == text


@pytest.mark.parametrize(
    ("guessed", "phase", "text"),
    [
        (False, Phase.STOPPED, "stopped (it has no quick stop: ramp stop)"),
        (True, Phase.FAILED, not_proved(PROFILE.name)),
    ],
)
def test_standstill_by_a_guessed_profile_proves_nothing(
    guessed: bool, phase: Phase, text: str, journal: Journal
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    here.session.guessed, here.stop.wanted = guessed, "quick-stop"
    here.stop._tell_standing("ready", 0.0)
    assert here.reports == [(phase, text, 1000.0)]
