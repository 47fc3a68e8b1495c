"""Which keys an app takes: alone, of a piece, held, before a stop, into a text."""

from __future__ import annotations

import asyncio
import time
from typing import ClassVar

import pytest
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.pilot import Pilot
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from tests.limits import KEY_TOO_LATE
from tests.ui.test_flows import until
from tui.terminal import type_ahead
from tui.terminal.fields import takes_space, takes_text
from tui.terminal.stroke import Stroke, attach
from tui.terminal.type_ahead import TypeAhead


class Line(Static, can_focus=True):
    """A line that keys are typed into, of a widget that Textual does not know."""

    takes_text = True
    takes_space = False
    typed = ""

    def on_key(self, event: events.Key) -> None:
        self.typed += event.character or f"<{event.key}>"
        event.stop()


class Question(ModalScreen[None]):
    """A dialog with a text, which takes a while to come."""

    AUTO_FOCUS = "Input"

    def compose(self) -> ComposeResult:
        yield Input(id="answer")

    def on_input_submitted(self) -> None:
        self.dismiss()


class Panel(App[None]):
    """Accepts keys as the panel does, and records their effects."""

    AUTO_FOCUS = None
    BINDINGS: ClassVar = [
        Binding("r", "act('run')"),
        Binding("enter", "act('enter')"),
        Binding("y", "act('yes')"),
        Binding("escape", "act('escape')"),
        Binding("up", "act('up')"),
        Binding("f", "ask"),
        Binding("s", "slow"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self.stops = 0
        self.done: list[str] = []
        self.strokes: list[Stroke | None] = []
        self.not_taken: list[int] = []
        self.late = 0
        self.submitted: list[str] = []
        self.typed = TypeAhead(self, self)

    def compose(self) -> ComposeResult:
        yield Input(id="text")
        yield Input(id="number", type="integer")
        yield Line("", id="line")

    async def on_event(self, event: events.Event) -> None:
        ours = isinstance(event, events.Key | events.Paste) and not event.is_forwarded
        if ours and not self.typed.admit(event):  # type: ignore[arg-type]
            return
        await super().on_event(event)

    def stop_stamp(self) -> object:
        return self.stops

    def only_shows(self, key: str, character: str | None) -> bool:
        return key == "f"

    def report_ignored_keys(self, count: int, *, late: bool = False) -> None:
        self.not_taken.append(count)
        self.late += late

    def on_input_submitted(self, event: Input.Submitted) -> None:
        self.submitted.append(event.value)

    def action_act(self, name: str) -> None:
        self.done.append(name)
        self.strokes.append(self.typed.stroke)

    def action_ask(self) -> None:
        self.push_screen(Question())

    async def action_slow(self) -> None:
        self.done.append("slow")
        await asyncio.sleep(0.1)

    def send(self, *keys: str, stroke: Stroke | None = None) -> None:
        """Keys as the driver delivers them."""
        for key in keys:
            event = events.Key(key, key if len(key) == 1 else None)
            attach(event, stroke or Stroke(time.monotonic(), self.stops))
            self.post_message(event)


def piece(count: int = 9, stamp: object = 0, *, steps: bool = False) -> Stroke:
    return Stroke(time.monotonic(), stamp, alone=False, steps=steps, piece=count)


async def quiet(pilot: Pilot[None], app: Panel) -> None:
    """Wait until every key had its effect."""
    await until(pilot, lambda: app.typed.stroke is None)
    await pilot.pause()


async def test_single_key_acts_but_a_burst_does_not() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("r")
        await until(pilot, lambda: app.done == ["run"])
        app.send("r", "enter", "y", "escape", stroke=piece())
        await until(pilot, lambda: app.not_taken == [4])
        assert app.done == ["run"]
        app.send("r", stroke=Stroke(time.monotonic(), 0, alone=False, held=True))
        await until(pilot, lambda: app.done == ["run", "run"])


async def test_immediate_key_acts_only_while_harmless() -> None:
    """When its turn has come, another screen may be there, on which it would command."""
    app = Panel()
    async with app.run_test() as pilot:
        at_once = Stroke(time.monotonic(), 0, alone=False, steps=False, at_once=True)
        app.send("r", stroke=at_once)
        await until(pilot, lambda: app.not_taken == [1])
        assert app.done == []
        app.send("f", stroke=at_once)
        await until(pilot, lambda: isinstance(app.screen, Question))
        app.send("r", stroke=at_once)
        await until(pilot, lambda: app.not_taken == [1, 1])
        assert app.screen.query_one("#answer", Input).value == ""


async def test_each_burst_is_reported_once() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send(*"rrr", stroke=piece())
        await until(pilot, lambda: app.not_taken == [3])
        app.send(*"rr", stroke=piece())
        await until(pilot, lambda: app.not_taken == [3, 2])


async def test_burst_writes_text_and_moves_the_cursor_but_never_submits() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        field = app.query_one("#text", Input)
        field.focus()
        app.send(*"abr", "backspace", "left", "c", "enter", "escape", "ctrl+k", stroke=piece())
        await until(pilot, lambda: app.not_taken == [3])
        assert field.value == "acb"
        assert app.submitted == []
        app.send("enter")
        await until(pilot, lambda: app.submitted == ["acb"])
        assert app.done == []


async def test_widget_declares_that_it_accepts_text() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        line = app.query_one(Line)
        line.focus()
        app.send(*"30", "left", "enter", stroke=piece())
        await until(pilot, lambda: app.not_taken == [1])
        assert line.typed == "30<left>"


async def test_arrow_of_a_burst_is_passed_with_its_stroke() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("up", stroke=piece(steps=True))
        app.send("up", stroke=piece())
        await until(pilot, lambda: app.done == ["up", "up"])
        assert [stroke and stroke.steps for stroke in app.strokes] == [True, False]
        assert app.not_taken == []
        await quiet(pilot, app)
        assert app.typed.stroke is None


async def test_stop_discards_keys_waiting_after_another() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("s", "r", "enter")
        await until(pilot, lambda: app.done == ["slow"])
        app.stops += 1
        app.send("y")
        await until(pilot, lambda: "yes" in app.done)
        await quiet(pilot, app)
        assert app.done == ["slow", "yes"]
        assert app.not_taken == []


async def test_stop_discards_key_read_before_it() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.stops = 3
        app.send("r", stroke=Stroke(time.monotonic(), 2))
        app.send("y", stroke=Stroke(time.monotonic(), 3))
        await until(pilot, lambda: app.done == ["yes"])
        assert [stroke and stroke.stamp for stroke in app.strokes] == [3]


async def test_synthetic_key_is_single_and_current() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.stops = 7
        await pilot.press("r")
        (stroke,) = app.strokes
        assert stroke is not None
        assert (stroke.alone, stroke.stamp, stroke.piece) == (True, 7, 1)


async def test_held_key_ends_on_release_even_in_a_slow_app() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("s")
        app.send(*["up"] * 50, stroke=Stroke(time.monotonic(), 0, alone=False, held=True))
        await until(pilot, lambda: app.done == ["slow", "up"])
        await quiet(pilot, app)
        assert app.done == ["slow", "up"]


async def test_key_delayed_long_is_handled_like_a_burst() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        before = Stroke(time.monotonic() - KEY_TOO_LATE - 0.1, 0)
        app.send("r", "up", stroke=before)
        await until(pilot, lambda: app.not_taken == [1])
        assert app.late == 1
        assert app.done == ["up"]
        assert [stroke and stroke.steps for stroke in app.strokes] == [False]
        app.query_one("#text").focus()
        app.send("r", stroke=before)
        await until(pilot, lambda: app.query_one("#text", Input).value == "r")


async def test_key_delayed_by_two_seconds_still_acts() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("r", stroke=Stroke(time.monotonic() - 2.0, 0))
        await until(pilot, lambda: app.done == ["run"])


async def test_keys_typed_ahead_reach_the_dialog() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("f", *"30")
        await until(pilot, lambda: isinstance(app.screen, Question))
        answer = app.screen.query_one(Input)
        await until(pilot, lambda: answer.value == "30")


async def test_key_after_enter_in_a_dialog_reaches_the_screen_below() -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.send("f", "3", "enter", "r", "y")
        await until(pilot, lambda: "yes" in app.done)
        assert app.done == ["run", "yes"]


async def test_key_follows_one_whose_work_takes_too_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A screen that waits for something gets the next key, for example Esc."""
    monkeypatch.setattr(type_ahead, "WAIT_LONGEST", 0.1)
    app = Panel()
    async with app.run_test() as pilot:
        released = asyncio.Event()
        app.query_one(Line).call_later(released.wait)
        app.set_focus(app.query_one(Line))
        app.send("left", "r")
        await until(pilot, lambda: app.typed.stroke is None)
        assert app.query_one(Line).typed == ""
        released.set()
        await until(pilot, lambda: app.query_one(Line).typed == "<left>r")


@pytest.mark.parametrize(
    ("focus", "value"), [("#text", "run"), ("#number", ""), ("#line", ""), (None, "")]
)
async def test_paste_goes_into_a_text_only(focus: str | None, value: str) -> None:
    app = Panel()
    async with app.run_test() as pilot:
        app.set_focus(app.query_one(focus) if focus else None)
        app.post_message(events.Paste("run\r\nr\n"))
        app.send("y" if focus is None else "f12")
        await pilot.pause()
        await quiet(pilot, app)
        assert app.query_one("#text", Input).value == value
        assert app.submitted == []
        assert app.done in ([], ["yes"])
        assert len(app._notifications) == (focus is None)


@pytest.mark.parametrize(
    ("widget", "text", "space"),
    [
        (Input(), True, True),
        (Input(type="integer"), True, False),
        (Input(type="number"), True, False),
        (Line(), True, False),
        (Static(), False, False),
        (None, False, False),
    ],
    ids=lambda value: type(value).__name__,
)
def test_field_accepts_its_keys(widget: Input | Static | None, text: bool, space: bool) -> None:
    assert (takes_text(widget), takes_space(widget)) == (text, space)


def test_text_field_may_refuse_spaces() -> None:
    class Reference(Input):
        takes_space = False

    assert takes_text(Reference())
    assert not takes_space(Reference())
