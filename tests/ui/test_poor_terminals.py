"""Terminals without symbols, colors or space: complete text with the means they have."""

from __future__ import annotations

import pytest
from rich.color import ColorSystem
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.terminal.abilities import ASCII, Abilities

from . import fakes
from .test_command_pictures import shown_over
from .test_line_pictures import STATES, same_ports
from .test_monitor_pictures import SCENES, panel, show
from .test_pictures import Compare

pytestmark = pytest.mark.drawn
__all__ = ["same_ports"]

POOR = {
    "plain signs": Abilities(ASCII),
    "latin-1": Abilities("iso8859-1"),
    "no colors": Abilities(colors=None),
    "sixteen colors": Abilities(colors=ColorSystem.STANDARD),
    "vt100": Abilities(ASCII, None),
}
"""Terminals that lack something, as `abilities_of` finds them."""

LOOKED_AT = ("1", "2", "question_mark", "escape", "ctrl+p", "escape", "m", "escape", "q")
"""Keys that lead through screens and dialogs."""


@pytest.mark.parametrize("terminal", POOR)
@pytest.mark.parametrize("name", kept(["running", "fault", "run"], "fault"))
@pytest.mark.sweep
def test_monitor_on_a_poor_terminal(
    snap_compare: Compare, name: str, terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES[name], monkeypatch, POOR[terminal])
    keys = SCENES[name].keys
    assert snap_compare(
        app, terminal_size=(80, 24), run_before=lambda pilot: show(app, screen, keys, pilot)
    )


FEWER_COLORS = ("sixteen colors", "no colors")


@pytest.mark.parametrize("terminal", FEWER_COLORS)
@pytest.mark.parametrize("name", kept(["running", "fault", "not-heard"], "fault"))
def test_monitor_on_a_small_poor_terminal(
    snap_compare: Compare, name: str, terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES[name], monkeypatch, POOR[terminal])
    assert snap_compare(
        app, terminal_size=(60, 16), run_before=lambda pilot: show(app, screen, (), pilot)
    )


@pytest.mark.usefixtures("same_ports")
@pytest.mark.parametrize("terminal", FEWER_COLORS)
@pytest.mark.parametrize("size", [(80, 24), (60, 16)], ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("state", kept(["thirty-one", "lost-drive"], "thirty-one"))
@pytest.mark.sweep
def test_list_of_drives_on_a_poor_terminal(
    snap_compare: Compare, state: str, size: tuple[int, int], terminal: str
) -> None:
    app = fakes.app_of(abilities=POOR[terminal])

    async def shown(pilot: Pilot[None]) -> None:
        await pilot.pause()
        await STATES[state](app, pilot)

    assert snap_compare(app, terminal_size=size, run_before=shown)


@pytest.mark.parametrize("terminal", ["vt100", "sixteen colors"])
def test_faults_on_a_poor_terminal(
    snap_compare: Compare, terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, show_faults = shown_over("faults", monkeypatch, POOR[terminal])
    assert snap_compare(app, terminal_size=(80, 24), run_before=show_faults)


@pytest.mark.parametrize("terminal", ["plain signs", "vt100"])
@pytest.mark.sweep
async def test_plain_symbols_are_ascii_on_every_screen(
    terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES["running"], monkeypatch, POOR[terminal])
    async with app.run_test(size=(80, 24)) as pilot:
        await show(app, screen, (), pilot)
        for key in LOOKED_AT:
            await pilot.press(key)
            await pilot.pause()
            strips = app.screen._compositor.render_strips()
            assert [strip.text for strip in strips if not strip.text.isascii()] == []


async def test_no_screen_has_colors_without_color_support(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app, screen = panel(SCENES["fault"], monkeypatch, POOR["no colors"])
    async with app.run_test(size=(80, 24)) as pilot:
        await show(app, screen, (), pilot)
        for key in LOOKED_AT:
            await pilot.press(key)
            await pilot.pause()
            styles = [
                style
                for strip in app.screen._compositor.render_strips()
                for _, style, _ in strip
                if style is not None
            ]
            assert not [style for style in styles if style.color or style.bgcolor]
            assert any(style.reverse for style in styles), "what is chosen is seen"


@pytest.mark.parametrize(("terminal", "has_grid"), [("sixteen colors", True), ("no colors", False)])
async def test_curve_has_no_grid_without_colors(
    terminal: str, has_grid: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, screen = panel(SCENES["running"], monkeypatch, POOR[terminal])
    async with app.run_test(size=(80, 24)) as pilot:
        await show(app, screen, (), pilot)
        rows = [strip.text for strip in app.screen._compositor.render_strips()]
        assert any("·" in row[6:72] for row in rows[9:18]) is has_grid


async def test_reference_of_a_plain_bar_differs_from_a_tick(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app, screen = panel(SCENES["running"], monkeypatch, POOR["plain signs"])
    async with app.run_test(size=(80, 24)) as pilot:
        await show(app, screen, (), pilot)
        rows = [strip.text for strip in app.screen._compositor.render_strips()]
        assert [row for row in rows if "+=============#--+ 60" in row]
