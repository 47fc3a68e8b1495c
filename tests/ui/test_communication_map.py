"""The communication map: its rows for every family, and the four words of the user's choice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from tests.drive.test_channels import IDLE
from tests.drive.test_signal_path import ATV21, ATV71, PX
from tests.session.sets_bench import bench
from tui.app import DrivePanelApp
from tui.drive.blocks.user_words import FORMATS, UserWord, WordFormat
from tui.drive.profile import library
from tui.drive.profile.schema import Quantity
from tui.safety import LOOK_IS_OLD
from tui.screens.control.map_screen import MapScreen, row_lines, word_lines
from tui.screens.frame import TAB_OF_PAGE, TABS
from tui.session.blocks.editor import load_words
from tui.session.communication_map import CommunicationMap, MapRow
from tui.session.console import DriveConsole

from . import fakes
from .test_control_view import MovedClock

FAMILIES: dict[str, Mapping[str, int]] = {
    "atv21": {**ATV21, "FA20": 0, "FD42": 1, "FD49": 0, "FA13": 0},
    "atv31": {**IDLE, "CMD": 6, "LFr": 300, "CMI": 0, "LFRD": 0},
    "atv312": {**IDLE, "CMD": 6, "LFr": 300, "CMI": 0, "LFRD": 0},
    "atv71": {
        **ATV71, "ETA": 0x0637, "ETI": 0, "CMI": 0, "LFRD": 1200, "LCR": 84, "LFT": 0x8000,
        **{f"NMA{n}": 0 for n in range(1, 9)}, **{f"NCA{n}": 0 for n in range(1, 9)},
        "NMA1": 3201, "NM1": 0x0637,
    },
    "powerdrive": {**PX, "10.40": 5},
}  # fmt: skip


def map_of(family: str, clock: MovedClock | None = None) -> CommunicationMap:
    console = fakes.console_of(None, family=family, clock=clock or MovedClock())
    for code, raw in FAMILIES[family].items():
        console.session.image.confirm(code, raw, fakes.NOW)
    return CommunicationMap(console)


def rows_of(found: CommunicationMap) -> dict[str, MapRow]:
    return {row.head: row for row in found.rows}


def test_map_shows_channels_words_references_and_scanner() -> None:
    rows = rows_of(map_of("atv71"))
    assert rows["Command"] == MapRow("Command", "Modbus", "CMD 16#000F")
    assert rows["Reference"] == MapRow("Reference", "Modbus", "LFR 40.0 Hz")
    assert rows["ETA"].text == "16#0637"
    assert rows["ETA"].detail == "ready, switched on, enabled, power, at reference"
    assert rows["LFRD"].text == "1200 rpm"
    [scanner] = [row for row in rows.values() if "NM1 ETA 16#0637" in row.text]
    assert scanner.text == "NM1 ETA 16#0637"
    assert "no word mapped" in [row.text for row in rows.values()]


@pytest.mark.parametrize("family", FAMILIES)
def test_map_of_each_family_has_its_command_and_status_word(family: str) -> None:
    profile, found = library.load(family), map_of(family)
    rows = rows_of(found)
    quantities: tuple[Quantity, ...] = ("command_word", "status_word")
    for quantity in quantities:
        parameter = profile.quantity(quantity)
        assert parameter is not None
        assert parameter.code in rows
        assert parameter.code in found.codes
    assert rows["Command"].text not in ("", "not known")


@pytest.mark.parametrize("family", FAMILIES)
def test_old_words_are_not_available(family: str) -> None:
    clock = MovedClock()
    found = map_of(family, clock)
    clock.later = LOOK_IS_OLD + 0.1
    assert {row.text for row in found.rows} <= {"-----", "not known"}


FORMATTED = {
    "hex": "FFF0 hex", "signed": "-16", "unsigned": "65520", "bits": "1111 1111 1111 0000",
}  # fmt: skip


@pytest.mark.parametrize("form", FORMATS)
def test_word_is_shown_in_each_format(form: WordFormat) -> None:
    assert UserWord(3202, form).text(-16) == FORMATTED[form]
    assert UserWord(3202, form).text(None) == "-----"


async def test_chosen_words_are_those_of_scanner_with_their_formats() -> None:
    with bench("atv71", sets={"ACC": 37}) as here:
        console = DriveConsole(here.session, here.journal)
        found = CommunicationMap(console)
        assert [word.address for word in found.own] == [0, 0, 0, 0]
        found.choose(1, "ACC")
        found.turn_format(1, 1)
        found.choose(3, "LFT")
        assert found.own_text(found.own[1]) == ("ACC Acceleration time", "-----")
        await found.read_own()
        assert found.own_text(found.own[1]) == ("ACC Acceleration time", "37")
        found.turn_format(1, -1)
        assert found.own_text(found.own[1]) == ("ACC Acceleration time", "0025 hex")
        assert load_words(here.session) == found.own == console.blocks.words
        found.choose(1, "")
        assert load_words(here.session)[1].address == 0


@pytest.mark.parametrize("width", [60, 80, 120, 200])
@pytest.mark.parametrize("family", FAMILIES)
def test_rows_fit_the_width(family: str, width: int) -> None:
    found = map_of(family)
    found.choose(0, next(iter(FAMILIES[family])))
    words = [(word, *found.own_text(word)) for word in found.own]
    lines = [line for row in found.rows for line in row_lines(row, width)]
    assert all(line.cell_len <= width for line in (*lines, *word_lines(words, width)))


async def test_word_is_chosen_and_formatted_by_keys() -> None:
    app = fakes.app_of(kind=fakes.Easel)
    found = map_of("atv71")
    app.opened = fakes.opened()
    fakes.choose(app, found.console)

    async def read(codes: list[str], **_: Any) -> Any:
        return {}

    found.console.read = read  # type: ignore[method-assign, assignment]
    async with app.run_test(size=(80, 24)) as pilot:
        await app.push_screen(MapScreen(found.console))
        await pilot.pause()
        await pilot.press("down", "enter")
        await pilot.pause(0.4)
        await pilot.press(*"LCR")
        await pilot.pause()
        await pilot.press("enter")
        await pilot.pause()
        await pilot.press("right")
        await pilot.pause()
        assert (found.own[1].address, found.own[1].format) == (3204, "signed")
        screen = "\n".join(s.text for s in app.screen._compositor.render_strips())
        assert "LCR Motor current" in screen
        await pilot.press("delete")
        await pilot.pause()
        assert found.own[1].address == 0


def shown_rows(app: DrivePanelApp) -> list[str]:
    """Rows of the terminal."""
    return [strip.text.rstrip() for strip in app.screen._compositor.render_strips()]


@pytest.mark.parametrize("size", [(60, 16), (80, 24), (120, 40)])
async def test_every_row_of_the_map_can_be_reached(size: tuple[int, int]) -> None:
    """At 80 x 24 the map ended with an ellipsis before ETI."""
    app, found = fakes.app_of(kind=fakes.Easel), map_of("atv71")
    for slot in range(1, 9):
        found.console.session.image.confirm(f"NMA{slot}", 3201, fakes.NOW)
    app.opened = fakes.opened()
    fakes.choose(app, found.console)

    async def read(codes: list[str], **_: Any) -> Any:
        return {}

    found.console.read = read  # type: ignore[method-assign, assignment]
    async with app.run_test(size=size) as pilot:
        await app.push_screen(MapScreen(found.console))
        await pilot.pause()
        wanted = {line.plain.rstrip() for row in found.rows for line in row_lines(row, size[0])}
        first = set(shown_rows(app))
        heading = next(row for row in first if row.startswith("Channels"))
        assert ("PgUp, PgDn" in heading) == bool(wanted - first)
        seen = set(first)
        for _ in range(1 + len(wanted) // (size[1] - 10)):
            await pilot.press("pagedown")
            await pilot.pause()
            seen |= set(shown_rows(app))
        assert wanted <= seen
        await pilot.press("pageup", "pageup")
        await pilot.pause()
        assert wanted & set(shown_rows(app)) == wanted & first


def test_page_of_a_screen_lights_its_tab() -> None:
    names = {tab.place for tab in TABS}
    assert TAB_OF_PAGE == {"map": "control", "listening": "frames"}
    assert set(TAB_OF_PAGE.values()) <= names
