"""Rules of every question: keys that mean yes, when they count, and the motor state."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import pytest
from rich.text import Text
from textual.keys import _character_to_key
from textual.screen import ModalScreen

from tests.sweeps import kept
from tui.drive.profile import library
from tui.screens.blocks.screen import BlocksScreen
from tui.screens.command.command_keys import OptionsScreen
from tui.screens.connection.rows import rows_of
from tui.screens.control.screen import ControlSourceScreen
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm, SaveOffer
from tui.screens.dialogs.leave import LEAVE_KEYS, Leave
from tui.screens.dialogs.now import MotorStates
from tui.screens.dialogs.pick_file import PickFile
from tui.screens.dialogs.question import Question, hint, void_questions
from tui.screens.frame_source import drive_now
from tui.screens.keys.help import HelpScreen
from tui.screens.monitor.screen import ViewSource
from tui.screens.parameters.screen import ParametersScreen
from tui.screens.parameters.write_keys import RestQuestion
from tui.screens.state_words import state_words
from tui.session.command.stop_report import Phase, StopReport
from tui.session.fleet import FoundDrive
from tui.session.monitor.look import Look
from tui.session.monitor.snapshot import Snapshot
from tui.widgets.motor_state_text import motor_state_text

from . import fakes
from .test_command_flows import Bench, bench
from .test_command_flows import writes as writes
from .test_flows import arm, picture, shown, until

pytestmark = pytest.mark.long

MOMENT = 0.3
"""Seconds before which Enter and y do not answer, by the safety rules."""


class HandClock(fakes.StillClock):
    """A clock that advances by the test."""

    def __init__(self) -> None:
        self.now = fakes.NOW

    def monotonic(self) -> float:
        """Seconds that the test has advanced."""
        return self.now


IS_EARLY = Question._is_early


@pytest.fixture
def real_key_delay(monkeypatch: pytest.MonkeyPatch, quick_hands: None) -> None:
    """Questions as they are outside of tests."""
    monkeypatch.setattr(Question, "_is_early", IS_EARLY)


def confirm(
    *, loses: bool = True, now: MotorStates | None = None, by_itself: bool = False
) -> Confirm:
    return Confirm(
        "Write?", "It is written.", yes="writes", no="no", loses=loses, now=now, by_itself=by_itself
    )


class OpenQuestion:
    """A question on the screen of a panel without a line, and its result."""

    def __init__(self, question: Question[Any]) -> None:
        self.question = question
        self.app = fakes.app_of()
        self.clock = HandClock()
        self.app.panel_clock = self.clock
        self.answers: list[object] = []

    async def put(self, pilot: Any) -> None:
        await self.app.push_screen(self.question, self.answers.append)
        await until(pilot, lambda: self.question._drawn is not None)


def test_question_waits_the_moment_of_the_safety_rules() -> None:
    assert Question.SETTLED == MOMENT


YES: dict[str, tuple[Callable[[], Question[Any]], str, object]] = {
    "confirm": (confirm, "y", True),
    "harmless": (lambda: confirm(loses=False), "enter", True),
    "leave by enter": (lambda: Leave("it runs"), "enter", "stop"),
    "leave running": (lambda: Leave("it runs"), "l", "leave"),
    "reference": (lambda: Ask("Reference", lambda _: "", text="30", number=True), "enter", "30"),
    "file": (lambda: PickFile("Open", [("factory", "factory settings")], []), "enter", "factory"),
    "option": (
        lambda: OptionsScreen(library.load("atv71").data.charts[0].options, {}),
        "y",
        "first",
    ),
}


@pytest.mark.usefixtures("real_key_delay")
@pytest.mark.parametrize("name", YES)
async def test_early_key_does_not_answer(name: str) -> None:
    make, key, answer = YES[name]
    requested = OpenQuestion(make())
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        for passed in (0.0, 0.1, MOMENT - 0.01):
            requested.clock.now = fakes.NOW + passed
            requested.app.events.add("told", f"{passed} s after it was drawn")
            await pilot.press(key, key)
            newest = requested.app.events.newest
            assert newest is not None
            assert newest.text.startswith("Key ignored: it came before this could be read.")
            assert requested.answers == []
            assert requested.app.screen is requested.question
        requested.clock.now = fakes.NOW + MOMENT + 0.01
        await pilot.press(key)
        await until(pilot, lambda: bool(requested.answers))
        if answer == "first":
            assert requested.answers[0] is not None
        else:
            assert requested.answers == [answer]


@pytest.mark.usefixtures("real_key_delay")
@pytest.mark.parametrize(("key", "answer"), [("s", "stop"), ("escape", "stay"), ("q", "stay")])
async def test_stop_and_no_apply_immediately(key: str, answer: str) -> None:
    requested = OpenQuestion(Leave("it runs"))
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        await pilot.press(key)
        await until(pilot, lambda: requested.answers == [answer])


@pytest.mark.parametrize("key", ["escape", "q", "n"])
@pytest.mark.parametrize("loses", [True, False])
async def test_three_keys_answer_no(key: str, loses: bool) -> None:
    requested = OpenQuestion(confirm(loses=loses))
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        await pilot.press(key)
        await until(pilot, lambda: requested.answers == [False])


@pytest.mark.usefixtures("real_key_delay")
async def test_typed_text_does_not_answer_a_new_question() -> None:
    requested = OpenQuestion(confirm(by_itself=True))
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        for key in "frequency,any\ry":
            requested.clock.now += 0.9
            await pilot.press(_character_to_key(key))
        assert requested.answers == []
        assert requested.app.events.newest is not None
        assert "a question appeared as you typed" in requested.app.events.newest.text
        requested.clock.now += 1.01
        await pilot.press("y")
        await until(pilot, lambda: requested.answers == [True])
    for key in ("escape", "n"):
        requested = OpenQuestion(confirm(by_itself=True))
        async with requested.app.run_test(size=(80, 24)) as pilot:
            await requested.put(pilot)
            requested.clock.now += 0.0 if key == "escape" else 1.01
            await pilot.press(key)
            await until(pilot, lambda: requested.answers == [False])  # noqa: B023


@pytest.mark.parametrize(
    ("place", "calls"),
    [
        ("tui/screens/line_check.py", 1),
        ("tui/screens/command/command_keys.py", 1),
        ("tui/screens/command/teaching.py", 1),
        ("tui/screens/parameters/write_keys.py", 1),
    ],
)
def test_questions_without_a_key_open_automatically(place: str, calls: int) -> None:
    assert Path(place).read_text().count("by_itself=True") == calls
    assert RestQuestion.by_itself


async def test_enter_does_not_confirm_a_loss_and_says_so() -> None:
    requested = OpenQuestion(confirm())
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        hint = requested.question.query_one("#hint")
        assert str(hint.render()).startswith("y writes")
        await pilot.press("enter", "enter", "w", "s")
        assert requested.answers == []
        assert str(hint.render()).startswith("Press y or Esc")
        assert "y writes" in str(hint.render())
    assert str(Confirm("", "", yes="goes", no="stays", loses=False)._keys).startswith("y or Enter")


LONG = "\n".join(f"line {number}" for number in range(40))
OFFER = SaveOffer("Save drive 12 to EEPROM first", lambda: None)


def quit_question(text: str, offer: SaveOffer | None) -> Question[Any]:
    return Confirm("Quit?", text, yes="Quit", no="Stay", loses=True, offer=offer)


def leave_question(text: str, offer: SaveOffer | None) -> Question[Any]:
    return Leave(text, offer=offer)


MakeQuestion = Callable[[str, SaveOffer | None], Question[Any]]


@pytest.mark.parametrize("size", [(80, 24), (60, 16)])
@pytest.mark.parametrize("make", [quit_question, leave_question])
async def test_long_question_scrolls_with_its_keys_visible(
    make: MakeQuestion, size: tuple[int, int]
) -> None:
    requested = OpenQuestion(make(LONG, OFFER))
    async with requested.app.run_test(size=size) as pilot:
        await requested.put(pilot)
        hint = requested.question.query_one("#hint")
        await until(pilot, lambda: "Up, Down Scroll" in str(hint.render()))
        await until(pilot, lambda: 0 < hint.region.bottom < size[1] - 1)
        assert hint.region.height == hint.virtual_size.height
        assert "S Save drive 12 to EEPROM first" in str(hint.render())
        says = requested.question.query_one("#says")
        await pilot.press("down", "down")
        await until(pilot, lambda: says.scroll_y == 2)
        await pilot.press("end")
        await until(pilot, lambda: "line 39" in picture(requested.app))


@pytest.mark.parametrize("offers", [True, False])
@pytest.mark.parametrize(("make", "no"), [(quit_question, False), (leave_question, "stay")])
async def test_question_saves_after_a_no_and_only_if_it_offers_that(
    make: MakeQuestion, no: object, offers: bool
) -> None:
    saved: list[bool] = []
    offer = SaveOffer("Save first", lambda: saved.append(True))
    requested = OpenQuestion(make("", offer if offers else None))
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        await pilot.press("S")
        if not offers:
            assert requested.app.screen is requested.question
            await pilot.press("escape")
        await until(pilot, lambda: requested.answers == [no])
        await until(pilot, lambda: bool(saved) is offers)


# A stop of the drive ends the question


async def test_cancelled_question_answers_no_and_accepts_no_yes() -> None:
    requested = OpenQuestion(confirm())
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        requested.question._voided = True
        await pilot.press("y")
        await until(pilot, lambda: requested.answers == [False])
    for question, no in ((confirm(), False), (Leave("it runs"), "stay"), (ask(), None)):
        requested = OpenQuestion(question)
        async with requested.app.run_test(size=(80, 24)) as pilot:
            await requested.put(pilot)
            question.void()
            question.void()
            await until(pilot, lambda: bool(requested.answers))  # noqa: B023
            await pilot.pause(0.1)
            assert requested.app.screen is requested.app.connection
            assert requested.answers == [no]


async def test_question_ended_by_a_stop_does_nothing() -> None:
    question = confirm()
    requested = OpenQuestion(question)
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        question.void()
        await until(pilot, lambda: not question.query("#says"))
        question._tell_scrolling()  # after the refresh that has come too late


def ask() -> Ask:
    return Ask("Reference", lambda _: "", number=True)


async def test_question_below_another_screen_is_cancelled_when_shown() -> None:
    requested = OpenQuestion(confirm())
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        await requested.app.push_screen(HelpScreen("monitor"))
        requested.question.void()
        await pilot.pause()
        assert requested.app.screen.query("#help")
        await pilot.press("escape")
        await until(pilot, lambda: requested.answers == [False])
        assert requested.app.screen is requested.app.connection


async def test_only_questions_about_the_stopped_drive_end() -> None:
    app = fakes.app_of()
    snapshot = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)
    async with app.run_test(size=(80, 24)) as pilot:
        about = confirm(now=MotorStates(app, [fakes.console_of(snapshot).session]))
        other = confirm()
        await app.push_screen(other)
        await app.push_screen(about)
        void_questions(app, 5)
        await pilot.pause()
        assert app.screen is about
        void_questions(app, 2)
        await until(pilot, lambda: app.screen is other)


# What the motor does now


def now_shown(snapshot: Snapshot | None, look: Look | None = None, passed: float = 0.0) -> Text:
    now, session = fakes.NOW + passed, fakes.console_of(None).session
    words = partial(state_words, session)
    return motor_state_text(session.profile, snapshot, 0.5, look, now, words)


def now_text(snapshot: Snapshot | None, look: Look | None = None, passed: float = 0.0) -> str:
    return now_shown(snapshot, look, passed).plain


def test_only_the_unknown_state_stands_out_from_the_last_known_one() -> None:
    """The style of the first words must not be that of the whole line."""
    text = now_shown(fakes.snapshot_of(library.load("atv71"), fakes.RUNNING), passed=5.0)
    assert not text.style
    assert [text.plain[span.start : span.end] for span in text.spans] == [
        "? state unknown", "   5s ago: FORWARD",
    ]  # fmt: skip


def test_motor_state_is_shown_in_one_line() -> None:
    profile = library.load("atv71")
    running = fakes.snapshot_of(profile, fakes.RUNNING)
    assert now_text(running).split() == ["▶", "FORWARD", "50.0", "Hz", "8.4", "A"]
    assert now_text(fakes.snapshot_of(profile, fakes.FAULT)).startswith("■ FAULT ObF")
    place = now_text(running).index("Hz")
    assert now_text(fakes.snapshot_of(profile, fakes.READY)).index("Hz") == place
    # three cycles later it is not the present any more
    assert "▶" in now_text(running, passed=1.3)
    assert now_text(running, passed=5.0) == "? state unknown   5s ago: FORWARD"
    lost = fakes.snapshot_of(profile, fakes.RUNNING, error="No answer.", age=2.0)
    assert now_text(lost).startswith("? state unknown   2s ago")
    unplugged = fakes.snapshot_of(profile, fakes.RUNNING, line=fakes.LOST)
    assert now_text(unplugged).startswith("? state unknown")
    assert now_text(None) == "? state unknown"
    assert now_text(None, fakes.look_of(fakes.RUNNING)) == now_text(running)


def age_in_status_bar(snapshot: Snapshot | None, look: Look | None = None) -> float | None:
    console = fakes.console_of(snapshot)
    watch = fakes.FakeLineWatch(looks={console.device: look} if look else {})
    fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console), line_watch=watch)
    return drive_now(console, fleet, fakes.NOW).age


def test_age_of_a_state_is_that_of_its_values_not_of_the_last_failed_read() -> None:
    old = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING, age=14.0, error="No answer.")
    just_failed = replace(old, time=fakes.NOW)
    assert now_text(just_failed) == "? state unknown   14s ago: FORWARD"
    assert age_in_status_bar(just_failed) == 14.0
    before = fakes.look_of(fakes.RUNNING, age=14.0)
    failed = Look(None, "No answer.", fakes.NOW, None, {}, before)
    assert now_text(None, failed) == "? state unknown   14s ago: FORWARD"
    assert age_in_status_bar(None, failed) == 14.0


@pytest.mark.parametrize(
    ("raws", "word"),
    [
        ({**fakes.READY, "ETA": 0x0250, **fakes.CHANNELS}, "STANDBY"),
        ({**fakes.READY, "ETA": 0x0250, **fakes.CHANNELS, "CCC": 1}, "NOT READY"),
        (fakes.RUNNING, "FORWARD"),
        (fakes.FAULT, "FAULT ObF"),
    ],
)
def test_question_line_and_status_bar_have_one_word_for_a_state(
    raws: dict[str, int], word: str
) -> None:
    profile = library.load("atv71")
    console = fakes.console_of(fakes.snapshot_of(profile, raws))
    fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console))
    assert drive_now(console, fleet, fakes.NOW).words == word
    words = partial(state_words, console.session)
    question = motor_state_text(profile, console.latest, 0.5, None, fakes.NOW, words).plain
    assert question[2:].startswith(f"{word} ")
    row = rows_of(fleet, fakes.NOW, connected=True)[console.device]
    assert row.words.upper() == word or row.kind == "fault"


@pytest.mark.parametrize(
    ("raws", "standing", "word", "phase"),
    [
        (fakes.RUNNING, 0.05, "STOPPING", Phase.STOPPING),
        (fakes.RUNNING, 0.15, "FORWARD", None),  # read again since: someone has started it
        (fakes.FAULT, 0.05, "FAULT ObF", Phase.STOPPED),
        (fakes.READY, 0.05, "STANDBY", Phase.STOPPED),
    ],
)
def test_no_screen_shows_a_run_that_is_older_than_the_standstill(
    raws: dict[str, int], standing: float, word: str, phase: Phase | None
) -> None:
    """The stop reads the standstill before the next check of the drive does."""
    raws = {**raws, **fakes.CHANNELS} | ({"ETA": 0x0250} if raws is fakes.READY else {})
    console = fakes.console_of(fakes.snapshot_of(library.load("atv71"), raws))
    fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console))
    fleet.stopper._reports[console.device] = StopReport(
        console.device, Phase.STOPPED, "stopped", fakes.NOW - 5, fakes.NOW - standing
    )
    assert drive_now(console, fleet, fakes.NOW).words == word
    assert rows_of(fleet, fakes.NOW, connected=True)[console.device].words == word
    app = fakes.app_of()
    app.fleet = fleet
    reported = ViewSource(app, console)._stop(fakes.NOW)
    assert (reported and reported.phase) == phase


def test_unmonitored_drive_shows_the_state_of_its_checks() -> None:
    profile = library.load("atv71")
    state = fakes.snapshot_of(profile, fakes.RUNNING).state
    look = Look(state, "", fakes.NOW, None)
    assert now_text(None, look).strip() == "▶ FORWARD"
    assert now_text(None, look, 20.0).startswith("? state unknown   20s ago: FORWARD")
    old = fakes.snapshot_of(profile, fakes.READY, age=60)
    assert now_text(old, look).strip() == "▶ FORWARD"


async def test_open_question_shows_the_motor_state() -> None:
    requested = OpenQuestion(confirm())
    profile = library.load("atv71")
    console = fakes.console_of(fakes.snapshot_of(profile, fakes.RUNNING))
    fakes.choose(requested.app, console)
    session = console.session
    requested.question._now = MotorStates(requested.app, [session])
    async with requested.app.run_test(size=(80, 24)) as pilot:
        await requested.put(pilot)
        now = requested.question.query_one("#now")
        assert "FORWARD" in str(now.render())
        stopped = fakes.snapshot_of(profile, fakes.READY)
        cast("Any", console.monitor)._latest = replace(stopped)
        await until(pilot, lambda: "STANDBY" in str(now.render()))
        two = MotorStates(requested.app, [session, session])
        assert [line.split()[:2] for line in two().plain.splitlines()] == [["Now", "2"]] * 2
        six = MotorStates(requested.app, [session] * 6)
        assert six().plain.splitlines()[-1] == "and 2 more"


# The real questions: nothing is written on any key but y


async def write_parameters(made: Bench) -> None:
    await made.pilot.press("3")
    await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
    await until(made.pilot, lambda: bool(shown(made.app, "table")))
    await made.pilot.press("slash", *"hsp")
    made.app.screen.set_focus(None)
    await until(made.pilot, lambda: " raw " in shown(made.app, "detail"))
    await made.pilot.press("minus")
    await until(made.pilot, lambda: "1 staged" in shown(made.app, "status"))
    await arm(made.pilot)
    await made.pilot.press("w")


async def factory(made: Bench) -> None:
    made.drive().set("FRY", 1)
    await made.pilot.press("3")
    await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
    await until(made.pilot, lambda: bool(shown(made.app, "table")))
    await arm(made.pilot)
    await made.pilot.press("F")


async def save(made: Bench) -> None:
    await factory(made)
    await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
    await made.pilot.press("escape", "S")


async def write_block(made: Bench) -> None:
    await made.pilot.press("4")
    await until(made.pilot, lambda: isinstance(made.app.screen, BlocksScreen))
    await until(made.pilot, lambda: "ETA" in shown(made.app, "first"))
    await made.pilot.press("delete", "a")
    await until(made.pilot, lambda: " ARMED" in shown(made.app, "strip"))
    await made.pilot.press("w")


async def control_source(made: Bench) -> None:
    await made.pilot.press("6")
    await until(made.pilot, lambda: isinstance(made.app.screen, ControlSourceScreen))
    await until(made.pilot, lambda: "reading" not in shown(made.app, "now"))
    await made.pilot.press("down")
    await arm(made.pilot)
    await made.pilot.press("enter")


async def hand_back(made: Bench) -> None:
    await made.armed()
    await made.pilot.press("g")


async def option(made: Bench) -> None:
    await made.armed()
    await made.pilot.press("o", "down")


async def reset(made: Bench) -> None:
    made.drive().provoke(18)
    await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
    await made.armed()
    await made.pilot.press("x")


async def coast(made: Bench) -> None:
    await made.pilot.press("z")


async def brake(made: Bench) -> None:
    await made.pilot.press("b")


async def take(made: Bench) -> None:
    await made.armed()
    await made.pilot.press("t")


async def outputs(made: Bench) -> None:
    for slot, code in {"NCA1": "ACC", "NCA2": "DEC"}.items():
        made.drive().set(slot, made.drive().profile[code].address)
    await made.pilot.press("4")
    await until(made.pilot, lambda: "DEC" in shown(made.app, "second"))
    await made.pilot.press("a")
    await until(made.pilot, lambda: " ARMED" in shown(made.app, "strip"))
    await made.pilot.press("X", *"ACC=5.5", "enter")


QUESTIONS: dict[str, tuple[Callable[[Bench], Awaitable[None]], type[ModalScreen[Any]]]] = {
    "write": (write_parameters, Confirm),
    "factory": (factory, Confirm),
    "save": (save, Confirm),
    "block": (write_block, Confirm),
    "control": (control_source, Confirm),
    "hand back": (hand_back, Confirm),
    "option": (option, OptionsScreen),
    "reset": (reset, Confirm),
    "coast": (coast, Confirm),
    "brake": (brake, Confirm),
    "take control": (take, Confirm),
    "outputs": (outputs, Confirm),
}
FAMILY = {
    "write": "atv312",
    "hand back": "powerdrive",
    "take control": "powerdrive",
    "brake": "atv21",
}
"""The drive of the question, unless it is an Altivar 71."""


@pytest.mark.parametrize("name", kept(QUESTIONS, "write"))
async def test_only_y_writes(name: str) -> None:
    way, kind = QUESTIONS[name]
    async with bench(FAMILY.get(name, "atv71")) as made:
        for key in ("q", "n", "escape", "enter"):
            await way(made)
            await until(made.pilot, lambda: isinstance(made.app.screen, kind))
            now = str(made.app.screen.query_one("#now").render())
            states = ("READY", "STANDBY", "STOPPED", "FAULT", "unknown")
            assert any(word in now for word in states), now
            await made.pilot.press(key)
            await made.pilot.pause(0.3)
            assert isinstance(made.app.screen, kind) is (key == "enter")
            assert writes(made.app) == []
            if key != "enter":
                await back_to_monitor(made)
        await made.pilot.press("y")
        await until(made.pilot, lambda: not isinstance(made.app.screen, kind))
        await until(made.pilot, lambda: bool(writes(made.app)))


async def back_to_monitor(made: Bench) -> None:
    """Screen of the question; its staged edits and arming are discarded."""
    if isinstance(made.app.screen, ParametersScreen):
        made.app.screen.editor.staging.undo_all()
        await made.pilot.press("A", "2")
    elif isinstance(made.app.screen, BlocksScreen | ControlSourceScreen):
        await made.pilot.press("A", "2")
    else:
        await made.pilot.press("A")
    await until(made.pilot, lambda: bool(shown(made.app, "state")))


async def test_panel_does_not_exit_during_a_question() -> None:
    async with bench("atv312") as made:
        await write_parameters(made)
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        requested = made.app.screen
        await made.pilot.press("ctrl+q", "ctrl+c")
        await made.pilot.pause(0.2)
        assert made.app.screen is requested
        # another path asks too: staged edits would be lost
        await made.app.action_quit()
        await until(made.pilot, lambda: made.app.screen is not requested)
        await until(made.pilot, lambda: bool(made.app.screen.query("#question")))
        assert "Quit the panel?" in str(made.app.screen.query_one("#question").render())
        await made.app.action_quit()
        await made.pilot.press("q")
        await until(made.pilot, lambda: made.app.screen is requested)
        assert made.app._exit is False
        assert writes(made.app) == []


@pytest.mark.parametrize("motors", [1, 5])
@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
async def test_keys_of_leaving_are_always_at_the_bottom(size: tuple[int, int], motors: int) -> None:
    def runs() -> Text:
        return Text("\n".join(["Now  ▶ FORWARD"] * motors))

    reported = "\n".join(
        f"Device {n}: on loss of communication it acts 3 s after." for n in range(40)
    )
    requested = OpenQuestion(Leave(reported, cast(MotorStates, runs)))
    async with requested.app.run_test(size=size) as pilot:
        await requested.put(pilot)
        await pilot.pause()
        box = requested.question.query_one("#dialog").content_region
        assert box.contains_region(requested.question.query_one("#hint").region)
        assert requested.question.query_one("#says").max_scroll_y > 0


async def test_enter_on_control_says_why_there_is_no_question() -> None:
    async with bench("atv71") as made:
        await made.pilot.press("6")
        await until(made.pilot, lambda: isinstance(made.app.screen, ControlSourceScreen))
        await until(
            made.pilot, lambda: "Nothing: this configuration is active" in shown(made.app, "detail")
        )
        await made.pilot.press("enter")
        await until(made.pilot, lambda: "Nothing to write" in shown(made.app, "said"))
        await made.pilot.press("down", "enter")
        await until(made.pilot, lambda: "Not armed" in shown(made.app, "said"))
        assert writes(made.app) == []


def test_label_of_a_key_is_not_split_over_two_lines() -> None:
    text = hint(*LEAVE_KEYS, ("S", "Save first"))
    assert text.plain.splitlines() == [
        "s or Enter Stop and quit   l Leave it running and quit",
        "Esc or q Stay   S Save first",
    ]
    assert hint(("y", "Write"), ("Esc or q", "Cancel")).plain == "y Write   Esc or q Cancel"
