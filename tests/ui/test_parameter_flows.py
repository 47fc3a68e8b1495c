"""Editing parameters by keys: simulated drives over a real line, the whole panel above."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from textual.widgets import Input, OptionList

from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.pick_file import PickFile
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.edit_value import EditBits, EditNumber, PickValue
from tui.screens.parameters.screen import ParametersScreen

from .fakes import press
from .test_command_flows import Bench, bench, writes
from .test_flows import shown, until


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)


async def to_parameters(made: Bench) -> ParametersScreen:
    await made.pilot.press("3")
    await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
    screen = made.app.screen
    assert isinstance(screen, ParametersScreen)
    await until(made.pilot, lambda: bool(shown(made.app, "table")))
    return screen


async def find(made: Bench, code: str) -> None:
    """Search for a code; wait until its value is there."""
    made.app.screen.query_one("#search", Input).value = ""
    await made.pilot.press("slash", *code.lower(), "enter")
    await until(made.pilot, lambda: f"\n {code} " in shown(made.app, "detail"))
    await until(made.pilot, lambda: " raw " in shown(made.app, "detail"))


def read(file: Path) -> str:
    return file.read_text("utf-8")


def write(file: Path, text: str) -> None:
    file.write_text(text, "utf-8")


async def answer(made: Bench, key: str, text: str) -> None:
    """Press a key that asks for a text, and give it."""
    await press(made.pilot, key)
    await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
    made.app.screen.query_one(Input).value = text
    await made.pilot.press("enter")


async def open_file(made: Bench, file: Path) -> None:
    """Choose a file from the list of those that can be opened."""
    await made.pilot.press("ctrl+o")
    await until(made.pilot, lambda: isinstance(made.app.screen, PickFile))
    files = made.app.screen.query_one(OptionList)
    lines = [str(files.get_option_at_index(at).prompt) for at in range(files.option_count)]
    files.highlighted = next(at for at, line in enumerate(lines) if f" {file.name} " in line)
    await made.pilot.press("enter")


async def message(made: Bench, *parts: str) -> None:
    def said() -> str:
        return " ".join(shown(made.app, "message").split())

    await until(made.pilot, lambda: all(part in said() for part in parts))


async def test_find_edit_write_and_read_back() -> None:
    async with bench("atv71") as made:
        await to_parameters(made)
        await find(made, "ACC")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press(*"7.53", "enter")
        await until(made.pilot, lambda: "→ 7.5 s" in shown(made.app, "table"))
        assert "7.53 is held as 7.5 s" in shown(made.app, "message")
        assert made.drive().raw("ACC") == 30
        await made.pilot.press("w")
        await message(made, "Not armed")
        await made.pilot.press("a", "w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await message(made, "1 written and read back")
        assert made.drive().raw("ACC") == 75
        await until(made.pilot, lambda: "1 not saved" in shown(made.app, "status"))
        # after a write u stages what was held before; nothing is written by that
        await made.pilot.press("u")
        await until(made.pilot, lambda: "→ 3.0 s" in shown(made.app, "table"))
        assert made.drive().raw("ACC") == 75


async def test_u_takes_the_last_edit_back_and_delete_the_one_under_the_cursor() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        for code in ("ACC", "DEC", "HSP"):
            await find(made, code)
            await made.pilot.press("minus")
            await until(made.pilot, lambda code=code: code in screen.editor.staging.edits)  # type: ignore[misc]
        await find(made, "ACC")
        await made.pilot.press("u")
        assert [edit.code for edit in screen.editor.staging.edits] == ["ACC", "DEC"]
        await made.pilot.press("delete")
        assert [edit.code for edit in screen.editor.staging.edits] == ["DEC"]
        await made.pilot.press("delete")
        assert "This parameter is not staged" in shown(made.app, "message")
        await made.pilot.press("u")
        await until(made.pilot, lambda: "0 staged" in shown(made.app, "status"))
        assert writes(made.app) == []


async def test_a_parameter_is_found_from_every_screen() -> None:
    async with bench("atv71") as made:
        for key in "2567":
            await made.pilot.press(key, "slash", *"hsp", "enter")
            await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
            await until(made.pilot, lambda: "\n HSP " in shown(made.app, "detail"))
        assert writes(made.app) == []
        assert made.app.chosen is not None
        assert not made.app.chosen.session.arming.armed


async def test_the_groups_have_tab_and_the_arrows() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        first = screen.listed.code
        seen = [first]
        for key in ("tab", "right", "left", "shift+tab"):
            await made.pilot.press(key)
            seen.append(screen.listed.code)
        assert seen[0] == seen[4]
        assert seen[1] == seen[3]
        assert len(set(seen)) == 3


async def test_a_name_from_a_list_and_a_word_bit_by_bit() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        await find(made, "STT")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickValue))
        await made.pilot.press("down", "enter")
        await until(made.pilot, lambda: "→ Fast stop" in shown(made.app, "table"))
        await made.pilot.press("u")
        await until(made.pilot, lambda: "0 staged" in shown(made.app, "status"))
        made.app.push_screen(EditBits(screen.editor, made.drive().profile["CMI"]))
        await until(made.pilot, lambda: isinstance(made.app.screen, EditBits))
        await made.pilot.press("enter", "escape")


async def test_out_of_range_is_refused_while_it_is_typed() -> None:
    async with bench("atv312") as made:
        await to_parameters(made)
        await find(made, "HSP")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press(*"9999", "enter")
        held = made.app.screen.query_one("#held")
        assert "out of range" in str(held.render())
        assert isinstance(made.app.screen, EditNumber)
        await made.pilot.press("escape")
        assert "0 staged" in shown(made.app, "status")


async def test_steps_undo_all_and_selections() -> None:
    async with bench("atv71") as made:
        await to_parameters(made)
        await find(made, "HSP")
        await made.pilot.press("minus", "minus", "asterisk")
        await until(made.pilot, lambda: "→ 49.8 Hz" in shown(made.app, "table"))
        await made.pilot.press("escape", "d")
        await until(made.pilot, lambda: "staged 1" in shown(made.app, "title"))
        await made.pilot.press("U")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await until(made.pilot, lambda: "0 staged" in shown(made.app, "status"))
        await made.pilot.press("escape", "escape")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))


async def test_stop_works_here_and_in_its_fields() -> None:
    async with bench("atv71") as made:
        await made.running()
        await to_parameters(made)
        await find(made, "ACC")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press("f12")
        await made.stopped()


async def test_leaving_with_staged_edits_asks() -> None:
    async with bench("atv71") as made:
        await to_parameters(made)
        await find(made, "HSP")
        await made.pilot.press("minus", "q")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        follows = str(made.app.screen.query_one("#follows").render())
        assert "1 staged edits are not written" in follows
        await made.pilot.press("escape")
        # they stay when the screen is left and opened again
        await made.pilot.press("2")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))
        await to_parameters(made)
        await until(made.pilot, lambda: "1 staged" in shown(made.app, "status"))


async def test_back_up_change_compare_stage_and_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    async with bench("atv312") as made:
        await to_parameters(made)
        file = Path("pump.toml")
        await answer(made, "ctrl+s", str(file))
        await message(made, "parameters", "pump.toml")
        assert re.search(r"^ACC = \{.*raw = 30", read(file), re.MULTILINE)
        made.drive().set("ACC", 99)
        made.drive().set("HSP", 400)
        await open_file(made, file)
        await message(made, "pump.toml: 2 differ")
        await until(made.pilot, lambda: "differs 2" in shown(made.app, "title"))
        await made.pilot.press("i")
        await until(made.pilot, lambda: "2 staged" in shown(made.app, "status"))
        if not isinstance(made.app.screen, ParametersScreen):
            await made.pilot.press("escape")
        await made.pilot.press("a", "w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await message(made, "2 written and read back")
        assert (made.drive().raw("ACC"), made.drive().raw("HSP")) == (30, 500)


async def test_a_file_that_is_no_set_is_told_and_nothing_is_staged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    file = Path("broken.toml")
    write(file, "format = 1\n[drive\n")
    async with bench("atv312") as made:
        await to_parameters(made)
        await open_file(made, file)
        await message(made, "broken.toml:2")
        assert "0 staged" in shown(made.app, "status")


async def test_a_report_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    async with bench("atv312") as made:
        await to_parameters(made)
        await answer(made, "(report)", "pump.md")
        await message(made, "parameters", "pump.md")
        assert "Altivar 312" in read(Path("pump.md"))


async def test_the_panel_follows_a_drive_to_its_new_address() -> None:
    async with bench("atv71") as made:
        await to_parameters(made)
        parameter = made.drive().profile.quantity("line_address")
        assert parameter is not None
        await find(made, parameter.code)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press("7", "enter", "a", "w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        assert "new settings only" in str(made.app.screen.query_one("#follows").render())
        await made.pilot.press("y")
        await until(made.pilot, lambda: "Follow the drive?" in question(made))
        await made.pilot.press("y")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))
        await until(made.pilot, lambda: "device 7" in shown(made.app, "header"))


def question(made: Bench) -> str:
    found = made.app.screen.query("#question")
    return str(found.first().render()) if found else ""
