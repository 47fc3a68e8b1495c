"""Output of the panel to its terminal: little, and always what it shows."""

from __future__ import annotations

import re
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import get_character_cell_size
from rich.color import ColorSystem
from rich.console import RenderableType
from rich.segment import Segment
from rich.style import Style
from rich.text import Text
from textual.app import App, ComposeResult
from textual.containers import Horizontal
from textual.pilot import Pilot
from textual.screen import ModalScreen, Screen
from textual.strip import Strip
from textual.widgets import Label

from tui.app import DrivePanelApp
from tui.screens.frame import FRAME_LOOK
from tui.terminal.lean import Picture, strips_of
from tui.terminal.lean_app import ASK, WHOLE, LeanApp
from tui.terminal.pen import blank_style
from tui.widgets.lines import Lines, looks, piece_by_piece, runs

from .bytes_per_second import compare
from .fakes import NOW, StillClock

pytestmark = pytest.mark.drawn

CONTROL = re.compile(r"\x1b\[([0-9;?]*)([A-Za-z])")
ROWS, COLUMNS = 6, 40
Cell = tuple[str, str]


class Terminal:
    """As much of a terminal as the panel's updates need: places, colors, characters.

    With `wide`, it draws a symbol in two cells, as terminals for East Asian languages can.
    """

    def __init__(self, *, wide: bool = False) -> None:
        self.cells: dict[tuple[int, int], Cell] = {}
        self._wide = wide
        self._x, self._y, self._color = 0, 0, ""
        self._pen: dict[str, str] = {}

    def feed(self, data: str) -> None:
        at = 0
        for control in CONTROL.finditer(data):
            self._write(data[at : control.start()])
            at = control.end()
            if control[2] == "H":
                row, _, column = control[1].partition(";")
                self._x, self._y = int(column or 1) - 1, int(row or 1) - 1
            elif control[2] in "ABCD":
                assert control[2] in "AB" or self._x < COLUMNS, "a terminal may stay at the last"
                self._x += {"C": 1, "D": -1}.get(control[2], 0) * int(control[1] or 1)
                self._y += {"B": 1, "A": -1}.get(control[2], 0) * int(control[1] or 1)
            elif control[2] == "K":
                for x in range(self._x, COLUMNS):
                    self.cells[self._y, x] = (" ", self._color)
            elif control[2] == "m":
                self._set_color(control[1])
            elif control[2] == "X":
                for x in range(self._x, self._x + int(control[1])):
                    self.cells[self._y, x] = (" ", self._color)
        self._write(data[at:])

    def _set_color(self, numbers: str) -> None:
        """One number after another, as a terminal takes them."""
        left = numbers.split(";")
        while left:
            size = 1
            if left[0] in ("38", "48"):
                size = {"2": 5, "5": 3}[left[1]]
            name = _part(left[0])
            self._pen = {**self._pen, name: ";".join(left[:size])} if name else {}
            if name == "22":
                self._pen = {n: look for n, look in self._pen.items() if n not in ("1", "2", "22")}
            left = left[size:]
        order = sorted(self._pen, key=lambda name: (name == "behind", name == "front", name))
        self._color = ";".join(self._pen[name] for name in order)

    def _write(self, text: str) -> None:
        for character in text:
            if character == "\n":
                self._x, self._y = 0, self._y + 1
            elif character == "\r":
                self._x = 0
            elif character == "\b":
                assert 0 < self._x < COLUMNS
                self._x -= 1
            else:
                width = get_character_cell_size(character) * (1 + (self._wide and character == "▶"))
                if not width:
                    before, color = self.cells[self._y, self._x - 1]
                    self.cells[self._y, self._x - 1] = (before + character, color)
                    continue
                self.cells[self._y, self._x] = (character, self._color)
                if width == 2:
                    self.cells[self._y, self._x + 1] = ("", self._color)
                self._x += width

    def text(self) -> list[str]:
        return [
            "".join(self.cells.get((y, x), ("?", ""))[0] for x in range(COLUMNS))
            for y in range(ROWS)
        ]


def _part(number: str) -> str:
    """Attribute that a number of a style sets; nothing if it resets all."""
    if number in ("48", *map(str, (*range(40, 48), *range(100, 108)))):
        return "behind"
    if number in ("38", *map(str, (*range(30, 38), *range(90, 98)))):
        return "front"
    return "" if number == "0" else number


class Seen(App[None]):
    """Two columns of lines; every update goes to a checked terminal."""

    def __init__(self) -> None:
        super().__init__()
        self.terminal = Terminal()
        self.picture = Picture(erases=True)
        self.sent = 0

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield Lines(id="left")
            yield Lines(id="right")

    def _display(self, screen: Screen[Any], renderable: RenderableType | None) -> None:
        strips = strips_of(renderable)
        assert strips is not None or renderable is None
        self.picture.want(strips or [], self.console._color_system or ColorSystem.TRUECOLOR)
        data = self.picture.frame(WHOLE)
        self.sent += len(data)
        self.terminal.feed(data)


COLORS = [Style(color="#112233"), Style(color="#445566", bold=True), Style()]
PIECES = st.lists(
    st.tuples(st.text("ab█·é ", max_size=6), st.sampled_from(COLORS)), max_size=5
).map(lambda pieces: Text.assemble(*pieces))


@pytest.mark.parametrize("seed", range(3))
async def test_terminal_shows_the_content_of_the_screen(seed: int) -> None:
    """However the lines change, cell by cell and in color."""
    import random

    chance = random.Random(seed)
    app = Seen()
    async with app.run_test(size=(COLUMNS, ROWS)) as pilot:
        for _ in range(25):
            for side in ("left", "right"):
                app.query_one(f"#{side}", Lines).show([_line(chance) for _ in range(ROWS)])
            await pilot.pause()
            strips = app.screen._compositor.render_strips()
            fresh = Terminal()
            fresh.feed("\n".join(strip.render(app.console) for strip in strips))
            assert app.terminal.text() == [strip.text for strip in strips]
            for place, (character, color) in fresh.cells.items():
                shown, its_color = app.terminal.cells[place]
                assert shown == character
                assert _seen(shown, its_color) == _seen(character, color)


def _seen(character: str, color: str) -> str:
    """Visible part of a style: of a blank, its background."""
    return blank_style(color) if character == " " else color


class Dialog(ModalScreen[None]):
    """Covers a part of the content below, and dims the rest."""

    CSS = "Dialog { align: center middle; background: $background 60%; } Label { width: 12; }"

    def compose(self) -> ComposeResult:
        yield Label("wide 漢字 é e\u0301")


async def test_dialogs_and_resizes_leave_no_remains() -> None:
    import random

    chance = random.Random(7)
    app = Seen()

    def agree() -> None:
        strips = app.screen._compositor.render_strips()
        assert [row.rstrip("?") for row in app.terminal.text()][: len(strips)] == [
            strip.text for strip in strips
        ]

    async with app.run_test(size=(COLUMNS, ROWS)) as pilot:
        for step in range(20):
            for side in ("left", "right"):
                app.query_one(f"#{side}", Lines).show([_line(chance) for _ in range(ROWS)])
            await pilot.pause()
            app.push_screen(Dialog())
            await pilot.pause()
            agree()
            sent = app.sent
            app.screen.refresh()
            await pilot.pause()
            assert app.sent == sent, "what is shown already is not sent again"
            app.pop_screen()
            await pilot.pause()
            agree()
            if step % 5 == 4:
                # what a terminal shows after it was resized is its own affair
                app.terminal.cells.clear()
                app.picture.forget()
                app.screen.refresh()
                await pilot.pause()
                agree()


def _line(chance: Any) -> Text:
    line = Text()
    for _ in range(chance.randrange(1, 5)):
        length = chance.randrange(1, 6)
        line.append("".join(chance.choice("ab█·1") for _ in range(length)), chance.choice(COLORS))
    return line


@given(PIECES, PIECES)
def test_runs_cover_differences_with_little_excess(item: Text, other: Text) -> None:
    before, after = (strip_of(text) for text in (item, other))
    found = runs(before, after)
    old, new = (list(zip(*looks(strip), strict=True)) for strip in (before, after))
    inside = {x for first, end in found for x in range(first, end)}
    assert {x for x in range(COLUMNS) if old[x] != new[x]} <= inside
    for first, end in found:
        assert old[first] != new[first]
        assert old[end - 1] != new[end - 1]


def strip_of(text: Text) -> Strip:
    segments = [
        Segment(text.plain[at], text.get_style_at_offset(_console(), at))
        for at in range(len(text.plain))
    ]
    return Strip(segments).adjust_cell_length(COLUMNS, Style())


def test_empty_piece_repeats_nothing() -> None:
    text = Text("│ ").append_text(Text("", COLORS[0])).append("23", COLORS[1])
    found = piece_by_piece(text.plain, tuple(text.spans), text.style)
    assert found is not None
    assert "".join(segment.text for segment in found) == "│ 23"


def _console() -> Any:
    from rich.console import Console

    return Console()


async def test_unchanged_screen_sends_nothing_and_one_digit_few_bytes() -> None:
    app = Seen()
    async with app.run_test(size=(COLUMNS, ROWS)) as pilot:
        left = app.query_one("#left", Lines)
        left.show([Text("Output   49.9 Hz")])
        await pilot.pause()
        app.sent = 0
        left.show([Text("Output   49.9 Hz")])
        await pilot.pause()
        assert app.sent == 0
        left.show([Text("Output   49.8 Hz")])
        await pilot.pause()
        assert 0 < app.sent < 60


@pytest.mark.sweep
def test_monitor_sends_a_small_part_of_what_stock_widgets_send() -> None:
    """Both watch the same running drive; the measure itself is `tests.ui.bytes_per_second`."""
    ours, plain = compare(4.0)
    assert ours.size > 0
    assert ours.rate / plain.rate < 0.1


@given(st.lists(st.tuples(st.integers(0, ROWS - 1), PIECES, st.integers(0, 200)), max_size=20))
def test_partial_frames_add_up_to_the_same_screen(
    steps: list[tuple[int, Text, int]],
) -> None:
    """However little a frame may have, and whatever changes before the rest of it is sent."""
    picture, terminal, last = Picture(erases=True), Terminal(), {}
    for y, text, room in steps:
        last[y] = strip_of(text)
        picture.want([(0, y, last[y])], ColorSystem.TRUECOLOR)
        terminal.feed(picture.frame(room))
    terminal.feed(picture.frame(WHOLE))
    assert picture.is_shown
    assert picture.frame(WHOLE) == ""
    for y, strip in last.items():
        assert terminal.text()[y].rstrip("?") == strip.text


@pytest.mark.parametrize(
    ("erases", "moves"), [(True, [";3H"]), (False, [";3H", "12C", "14C"])], ids=["erases", "not"]
)
def test_dots_far_apart_are_erased_by_one_command(*, erases: bool, moves: list[str]) -> None:
    """Blanks between erased cells cost nothing, so the cursor does not have to jump over them."""
    picture = Picture(erases=erases)
    for text in ("| .            .              .", "|" + " " * 30):
        picture.want([(0, 0, Strip([Segment(text)]))], ColorSystem.TRUECOLOR)
        frame = picture.frame(WHOLE)
    assert re.findall(r"\x1b\[([\d;]*[HC])", frame) == moves
    assert frame.endswith("\x1b[K" if erases else "C ")


def shown_on(terminal: Terminal, picture: Picture, *rows: str) -> str:
    strips = [(0, y, Strip([Segment(row)])) for y, row in enumerate(rows)]
    picture.want(strips, ColorSystem.TRUECOLOR)
    frame = picture.frame(WHOLE)
    terminal.feed(frame)
    return frame


@pytest.mark.parametrize("seed", range(3))
def test_random_rows_on_a_terminal_whose_cursor_others_move(seed: int) -> None:
    """Each frame finds its first place although another program has written in between."""
    import random

    chance, terminal, picture = random.Random(seed), Terminal(), Picture(erases=True)
    rows = [" " * COLUMNS] * ROWS
    for _ in range(200):
        for _ in range(chance.randrange(1, 5)):
            y, x = chance.randrange(ROWS), chance.randrange(COLUMNS)
            text = chance.choice(("1", "25.0", "⠤⠤", "─┐", "é", " " * COLUMNS))
            rows[y] = (rows[y][:x] + text + rows[y][x + len(text) :])[:COLUMNS]
        shown_on(terminal, picture, *rows)
        assert terminal.text() == rows
        terminal.feed(f"\x1b[{chance.randrange(ROWS) + 1};{chance.randrange(COLUMNS) + 1}H")


def test_column_after_a_symbol_is_set_where_symbols_may_take_two_cells() -> None:
    terminal, picture = Terminal(wide=True), Picture()
    shown_on(terminal, picture, f"{'':>20}1")
    shown_on(terminal, picture, f"▶{'':>19}2")
    assert terminal.cells[0, 20][0] == "2"


def test_color_persists_until_the_contents_of_the_terminal_are_forgotten() -> None:
    picture, red = Picture(), Style(color="#ff0000")
    frames = []
    for text in ("1", "2", "2"):
        picture.want([(0, 0, Strip([Segment(text, red)]))], ColorSystem.TRUECOLOR)
        frames.append(picture.frame(WHOLE))
        if text == "2":
            picture.forget()
    assert frames == ["\x1b[H\x1b[0;38;2;255;0;0m1", "\x1b[H2", "\x1b[H\x1b[0;38;2;255;0;0m2"]


def test_runs_of_one_color_are_written_together() -> None:
    picture = Picture()
    for digit in "12":
        row = Text.assemble((digit, COLORS[0]), " " * 20, (digit, COLORS[1]))
        picture.want([(0, y, strip_of(row)) for y in range(3)], ColorSystem.TRUECOLOR)
        frame = picture.frame(WHOLE)
    assert len(re.findall(r"\x1b\[[\d;]*m", frame)) == 1, "it begins with the last color"


def test_frame_begins_with_the_status_bar_and_the_message() -> None:
    picture = Picture()
    rows = [(0, y, Strip([Segment(f"row{y}")])) for y in range(24)]
    picture.want(rows, ColorSystem.TRUECOLOR)
    order = [int(row) for row in re.findall(r"row(\d+)", picture.frame(WHOLE))]
    assert order == [0, 1, 22, 23, *range(2, 22)]
    picture.forget()
    assert re.findall(r"row\d+", picture.frame(1)) == ["row0"]


class Paced(LeanApp):
    """One line; its output is recorded, and acknowledged when the test wants."""

    def __init__(self) -> None:
        super().__init__()
        self.written: list[str] = []

    @property
    def _draws(self) -> bool:
        return True

    def compose(self) -> ComposeResult:
        yield Lines(id="left")

    def on_mount(self) -> None:
        driver: Any = self._driver
        driver.write = self.written.append

    async def show(self, pilot: Pilot[None], text: str) -> str:
        self.written.clear()
        self.query_one("#left", Lines).show([Text(text)])
        await pilot.pause()
        return "".join(self.written)

    def answer(self) -> str:
        self.written.clear()
        self.picture_taken(time.monotonic())
        return "".join(self.written)


async def test_unread_output_is_dropped_for_the_newest() -> None:
    app = Paced()
    async with app.run_test(size=(COLUMNS, ROWS)) as pilot:
        await pilot.pause()
        for _ in range(8):
            app.answer()
        sent = await app.show(pilot, "one")
        assert "one" in sent
        assert sent.endswith(ASK)
        assert await app.show(pilot, "two") == ""
        assert await app.show(pilot, "six") == ""
        then = app.answer()
        assert "six" in then
        assert "two" not in then
        assert app.answer() == ""


async def test_screen_is_refreshed_at_its_pace_right_after_the_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Both in one output; not on a slow link, where the refresh of the frame is rare."""
    app, calls = DrivePanelApp(), []
    async with app.run_test() as pilot:
        screen: Any = app.connection
        monkeypatch.setattr(type(screen), "LOOK", 0.5)
        monkeypatch.setattr(screen, "draw_frame", lambda _: calls.append("frame"))
        monkeypatch.setattr(screen, "look", lambda: calls.append("look"))
        app.panel_clock = clock = StillClock()
        for tick in range(4):
            monkeypatch.setattr(clock, "monotonic", lambda at=NOW + tick * FRAME_LOOK: at)
            app.look_around()
        assert calls == ["frame", "look", "frame"] * 2
        app.low_bandwidth = True
        calls.clear()
        screen.look_in_time()
        assert not calls
        await pilot.pause()


async def test_output_of_a_key_is_sent_immediately() -> None:
    app = Paced()
    async with app.run_test(size=(COLUMNS, ROWS)) as pilot:
        await pilot.pause()
        for _ in range(8):
            app.answer()
        assert "one" in await app.show(pilot, "one")
        app.hurry()
        assert "two" in await app.show(pilot, "two")
