"""Editing parameters by keys: simulated drives over a real line, the whole panel above."""

from __future__ import annotations

import re
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from textual.widgets import Input, OptionList

from tests.session.test_report_trends import written_run
from tests.sweeps import kept
from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.pick_file import PickFile
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.edit_value import EditBits, EditNumber, PickValue
from tui.screens.parameters.parameter_list import shows_steps
from tui.screens.parameters.screen import ParametersScreen
from tui.screens.parameters.write_keys import RestQuestion, Results

from . import fakes
from .fakes import press
from .test_command_flows import Bench, bench, writes
from .test_flows import arm, picture, shown, until
from .test_parameter_pictures import editor_of, failed, panel

pytestmark = pytest.mark.long


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
    await made.pilot.press("slash", *code.lower())
    made.app.screen.set_focus(None)  # Enter would edit the value
    await until(made.pilot, lambda: shown(made.app, "detail").startswith(f" {code} "))
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


async def stage(made: Bench, value: str, reported: str) -> None:
    """Type a value for the selected parameter; return the message about it."""
    await made.pilot.press("enter")
    await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
    made.app.screen.query_one(Input).value = value
    await made.pilot.press("enter")
    await message(made, reported)


async def open_file(made: Bench, file: Path) -> None:
    """Choose a file from the list of those that can be opened."""
    await made.pilot.press("ctrl+o")
    await until(made.pilot, lambda: isinstance(made.app.screen, PickFile))
    files = made.app.screen.query_one(OptionList)
    lines = [str(files.get_option_at_index(at).prompt) for at in range(files.option_count)]
    files.highlighted = next(at for at, line in enumerate(lines) if f" {file.name} " in line)
    await made.pilot.press("enter")


def table(made: Bench) -> str:
    """The list with its columns pushed together."""
    return " ".join(shown(made.app, "table").split())


async def message(made: Bench, *parts: str) -> None:
    def output() -> str:
        newest = made.app.events.newest
        return newest.text if newest is not None else ""

    await until(made.pilot, lambda: all(part in output() for part in parts))


def lines(made: Bench) -> str:
    """The message as it is shown, with the keys named after it."""
    return " ".join(shown(made.app, "said").split())


async def test_parameter_is_found_edited_written_and_verified() -> None:
    async with bench("atv312") as made:
        await to_parameters(made)
        await find(made, "ACC")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press(*"7.53", "enter")
        await until(made.pilot, lambda: "→ 7.5 s" in table(made))
        await message(made, "7.53 is rounded to 7.5 s")
        assert made.drive().raw("ACC") == 30
        await made.pilot.press("w")
        await message(made, "Not armed")
        await arm(made.pilot)
        await made.pilot.press("w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await message(made, "Wrote 1, all verified")
        assert made.drive().raw("ACC") == 75
        await until(made.pilot, lambda: "1 not saved" in shown(made.app, "status"))
        # that status may be drawn before the result of the write, which comes with the next look
        await until(made.pilot, lambda: "was 3.0 s" in table(made))
        # after a write u stages what was held before; nothing is written by that
        await made.pilot.press("u")
        await until(made.pilot, lambda: "→ 3.0 s" in table(made))
        assert made.drive().raw("ACC") == 75


@pytest.mark.sweep
async def test_u_undoes_the_last_edit_and_delete_the_selected_one() -> None:
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
        await message(made, "This parameter is not staged")
        await made.pilot.press("u")
        await until(made.pilot, lambda: "staged" not in shown(made.app, "status"))
        assert writes(made.app) == []


@pytest.mark.sweep
async def test_edit_messages_are_true_while_the_motor_runs() -> None:
    """TFR waits for a standstill: nothing says that w writes it, and it is counted until it is."""
    async with bench("atv71") as made:
        editor = (await to_parameters(made)).editor
        await arm(made.pilot)
        made.app.chosen.commander.run("forward", "20Hz")  # type: ignore[union-attr]
        await until(made.pilot, lambda: editor.state == "running")
        await find(made, "ACC")
        promise = "Press w to write it. The motor is running."
        await stage(made, "4", "ACC → 4.0 s. 1 staged.")
        await until(made.pilot, lambda: promise in lines(made))
        # on Scanner w is for slots: the keys are named on their own screen only
        await made.pilot.press("4")
        await until(made.pilot, lambda: "ACC → 4.0 s. 1 staged." in lines(made))
        assert "Press" not in lines(made)
        await made.pilot.press("3")
        await until(made.pilot, lambda: promise in lines(made))
        await find(made, "TFR")
        await stage(made, "70", "TFR → 70.0 Hz. 2 staged. To be written only at standstill: TFR.")
        await find(made, "DEC")
        await stage(made, "5", "DEC → 5.0 s. 3 staged. To be written only at standstill: TFR.")
        await made.pilot.press("W")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        follows = str(made.app.screen.query_one("#follows").render())
        assert {"ACC", "DEC", "TFR"} & set(follows.split()) == {"DEC"}
        await made.pilot.press("y")
        await message(made, "Wrote 1, all verified. 2 still staged: ACC, TFR")
        await until(made.pilot, lambda: "Now 5.0 s, was 3.0 s." in shown(made.app, "detail"))
        await made.pilot.press("u")
        await message(made, "TFR is no longer staged. 1 still staged.")
        await made.pilot.press("u")
        await message(made, "ACC is no longer staged. Nothing is staged.")
        await until(
            made.pilot, lambda: "Press u to stage the old value" in shown(made.app, "detail")
        )


@pytest.mark.sweep
async def test_parameter_is_found_from_every_screen() -> None:
    async with bench("atv312") as made:
        for key in "2567":
            await made.pilot.press(key, "slash", *"hsp", "enter", "escape")
            await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
            await until(made.pilot, lambda: shown(made.app, "detail").startswith(" HSP "))
        assert writes(made.app) == []
        assert made.app.chosen is not None
        assert not made.app.chosen.session.arming.armed


async def test_tab_and_arrows_select_groups() -> None:
    async with bench("atv312") as made:
        screen = await to_parameters(made)
        first = screen.listed.code
        seen = [first]
        for key in ("tab", "right", "left", "shift+tab"):
            await made.pilot.press(key)
            seen.append(screen.listed.code)
        assert seen[0] == seen[4]
        assert seen[1] == seen[3]
        assert len(set(seen)) == 3


async def test_simply_start_is_the_first_group_with_steps_in_order() -> None:
    async with bench("atv31") as made:
        screen = await to_parameters(made)
        lines = [line.strip() for line in shown(made.app, "groups").splitlines()]
        assert lines[lines.index("Unsaved") + 1] == "Commissioning"
        while not shows_steps(screen.listed):
            await made.pilot.press("left")
        await until(made.pilot, lambda: "2 Mains standard" in shown(made.app, "table"))
        assert screen.listed.code == "bFr"
        assert "1 Preparation" in shown(made.app, "table")
        assert "drive is powered without a run command" in table(made)
        listed = [item.code for item in screen.listed.items if item.code]
        assert listed[:3] == ["bFr", "UnS", "FrS"]
        await press(made.pilot, "down", "down", "down")
        assert screen.listed.code == "nCr"
        assert "Nameplate: From the motor's nameplate" in " ".join(
            shown(made.app, "detail").split()
        )
        # its limits follow the rated current of the drive
        await until(made.pilot, lambda: "(INV)" in shown(made.app, "detail"))
        await press(made.pilot, "up", "up", "up")
        await until(made.pilot, lambda: "1 Preparation" in shown(made.app, "table"))
        await press(made.pilot, "end")
        await until(made.pilot, lambda: "14 First run" in shown(made.app, "table"))


async def test_named_value_is_selected_and_word_edited_by_bits() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        await find(made, "STT")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickValue))
        await made.pilot.press("down", "enter")
        await until(made.pilot, lambda: "→ Fast stop" in table(made))
        await made.pilot.press("u")
        await until(made.pilot, lambda: "staged" not in shown(made.app, "status"))
        made.app.push_screen(EditBits(screen.editor, made.drive().profile["CMI"]))
        await until(made.pilot, lambda: isinstance(made.app.screen, EditBits))
        await made.pilot.press("enter", "escape")


async def test_value_out_of_range_is_refused_while_typed() -> None:
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
        assert "staged" not in shown(made.app, "status")


async def test_steps_undo_all_and_selections_edit_parameters() -> None:
    async with bench("atv312") as made:
        await to_parameters(made)
        await find(made, "HSP")
        await made.pilot.press("minus", "minus", "asterisk")
        await until(made.pilot, lambda: "→ 49.8 Hz" in table(made))
        await made.pilot.press("escape", "d")
        await until(made.pilot, lambda: "Staged 1 of 1" in shown(made.app, "status"))
        await made.pilot.press("U")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await until(made.pilot, lambda: "staged" not in shown(made.app, "status"))
        await made.pilot.press("escape", "escape")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))


async def test_stop_works_on_parameters_and_in_its_fields() -> None:
    async with bench("atv312") as made:
        await made.running()
        await to_parameters(made)
        await find(made, "ACC")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press("f12")
        await made.stopped()


async def test_leaving_with_staged_edits_asks_first() -> None:
    async with bench("atv312") as made:
        await to_parameters(made)
        await find(made, "HSP")
        await made.pilot.press("minus", "q")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        follows = str(made.app.screen.query_one("#follows").render())
        assert "1 staged edit is not written" in follows
        await made.pilot.press("escape")
        # they stay when the screen is left and opened again
        await made.pilot.press("2")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))
        await to_parameters(made)
        await until(made.pilot, lambda: "1 staged" in shown(made.app, "status"))


@pytest.mark.sweep
async def test_backup_is_compared_staged_and_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    async with bench("atv312") as made:
        await to_parameters(made)
        file = Path("pump.toml")
        await answer(made, "ctrl+s", str(file))
        await message(made, "Saved: ", " parameters", "pump.toml")
        assert re.search(r"^ACC = \{.*raw = 30", read(file), re.MULTILINE)
        made.drive().set("ACC", 99)
        made.drive().set("HSP", 400)
        await find(made, "HSP")  # a search of before hides nothing of what differs
        await open_file(made, file)
        await message(made, "pump.toml: 2 can be staged")
        await until(made.pilot, lambda: "Differs 1 of 2" in shown(made.app, "status"))
        await made.pilot.press("i")
        await until(made.pilot, lambda: "2 staged" in shown(made.app, "status"))
        if not isinstance(made.app.screen, ParametersScreen):
            await made.pilot.press("escape")
        await arm(made.pilot)
        await made.pilot.press("w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await message(made, "Wrote 2, all verified")
        assert (made.drive().raw("ACC"), made.drive().raw("HSP")) == (30, 500)


async def test_file_that_is_not_a_set_is_reported_and_stages_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    file = Path("broken.toml")
    write(file, "format = 1\n[drive\n")
    async with bench("atv312") as made:
        await to_parameters(made)
        await open_file(made, file)
        await message(made, "broken.toml:2")
        assert "staged" not in shown(made.app, "status")


@pytest.mark.sweep
async def test_report_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    async with bench("atv312") as made:
        await made.pilot.press("7")  # its key works on every screen
        await answer(made, "ctrl+r", "pump.md")
        assert made.app.place == "parameters"
        await message(made, "parameters", "pump.md")
        assert "Altivar 312" in read(Path("pump.md"))
        assert "Last run" not in read(Path("pump.md"))
        await answer(made, "ctrl+r", "pump.html")
        await message(made, "parameters", "pump.html")
        assert read(Path("pump.html")).count("<article>") == 1


async def test_report_has_the_trend_of_the_last_run_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tui.session.report_trends.RUN_SOUGHT_FOR", time.time())
    files = written_run(tmp_path / "record", profile="atv312")
    async with bench("atv312") as made:
        assert made.app.opened is not None
        made.app.opened.recorder = SimpleNamespace(files=lambda: files, close=bool)  # type: ignore[assignment]
        await answer(made, "ctrl+r", "pump.md")
        await message(made, "parameters", "pump.md")
        text = read(Path("pump.md"))
        assert "![Curve of the run](<pump-run.svg>)" in text
        assert text.index("## Last run") < text.index("## Writes by Drive Panel")
        assert "<polyline" in read(Path("pump-run.svg"))


@pytest.mark.sweep
async def test_panel_follows_a_drive_to_its_new_address() -> None:
    async with bench("atv71") as made:
        await to_parameters(made)
        parameter = made.drive().profile.quantity("line_address")
        assert parameter is not None
        await find(made, parameter.code)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press("7", "enter")
        await arm(made.pilot)
        await made.pilot.press("w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        assert "only at the new settings" in str(made.app.screen.query_one("#follows").render())
        await made.pilot.press("y")
        await until(made.pilot, lambda: "Open the line at the drive" in question(made))
        await made.pilot.press("y")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))
        await until(made.pilot, lambda: shown(made.app, "strip").startswith(" 7 "))


def question(made: Bench) -> str:
    found = made.app.screen.query("#question")
    return str(found.first().render()) if found else ""


@pytest.mark.parametrize(("code", "dialog"), [("ACC", EditNumber), ("STT", PickValue)])
async def test_stop_of_the_drive_closes_a_staging_dialog(code: str, dialog: type) -> None:
    async with bench("atv71") as made:
        await made.running()
        screen = await to_parameters(made)
        await find(made, code)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, dialog))
        await made.pilot.press("f12")
        await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
        await made.stopped()
        assert len(screen.editor.staging.edits) == 0


async def test_value_beyond_the_limit_of_another_parameter_is_refused() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        await find(made, "HSP")
        await until(made.pilot, lambda: "TFR" in screen.editor.values.raws)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press(*"70", "enter")
        assert "above TFR = 60.0 Hz" in str(made.app.screen.query_one("#held").render())
        assert "(TFR)" in str(made.app.screen.query_one("#about").render())
        assert isinstance(made.app.screen, EditNumber)
        await made.pilot.press("escape")
        assert len(screen.editor.staging.edits) == 0


@pytest.mark.parametrize("key", kept(["y", "escape", "f12"], "y", "f12"))
async def test_remaining_edits_after_a_failure_need_confirmation(key: str) -> None:
    async with bench("atv71") as made:
        await made.running()
        screen = await to_parameters(made)
        await until(made.pilot, lambda: {"TFR", "ACC"} <= set(screen.editor.values.raws))
        screen.editor.staging.stage("TFR", "65")  # at standstill only, so it fails
        screen.editor.staging.stage("ACC", "4")
        await arm(made.pilot)
        await made.pilot.press("w")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await until(made.pilot, lambda: "Write 2 parameters?" in question(made))
        await made.pilot.press("y")
        await until(made.pilot, lambda: isinstance(made.app.screen, RestQuestion))
        await until(made.pilot, lambda: "Write the other parameter anyway?" in question(made))
        assert made.drive().raw("ACC") == 30
        await made.pilot.press(key)
        await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
        if key == "y":
            await until(made.pilot, lambda: made.drive().raw("ACC") == 40)
            await until(made.pilot, lambda: "ACC" not in screen.editor.staging.edits)
        else:
            assert made.drive().raw("ACC") == 30
            assert "ACC" in screen.editor.staging.edits
        assert "TFR" in screen.editor.staging.edits


@pytest.mark.parametrize(("stops_since", "dialog"), [(0, RestQuestion), (1, Results)])
async def test_stop_after_the_write_shows_results_without_a_question(
    stops_since: int, dialog: type
) -> None:
    """After a stop, the screen shows the results of the write, and nothing more."""
    console = editor_of(fakes.RUNNING, armed=52.0)
    console.editor.applied = failed(console.editor)
    app = panel(console)
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        console.session.work.stops += stops_since
        await app.push_screen(ParametersScreen(console))
        await until(pilot, lambda: isinstance(app.screen, dialog))


async def test_files_show_their_drive_and_differences(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    profile, other = library.load("atv312"), library.load("atv71")
    own = ParameterSet(SetHead("atv312", family="Altivar 312", device=1), {"ACC": 99, "HSP": 500})
    write(Path("own.toml"), dump_set(profile, own))
    alien = ParameterSet(SetHead("atv71", family="Altivar 71", device=3), {"ACC": 30})
    write(Path("alien.toml"), dump_set(other, alien))
    write(Path("none.toml"), "format = 1\n")
    async with bench("atv312") as made:
        screen = await to_parameters(made)
        await until(made.pilot, lambda: {"ACC", "HSP"} <= set(screen.editor.values.raws))
        await made.pilot.press("ctrl+o")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickFile))
        files = made.app.screen.query_one(OptionList)

        def lines() -> str:
            return "\n".join(str(option.prompt) for option in files.options)

        await until(made.pilot, lambda: "..." not in lines())
        reported = {line.split()[0]: line for line in lines().splitlines() if ".toml" in line}
        assert "1 difference" in reported["own.toml"]
        assert "Altivar 71" in reported["alien.toml"]
        assert "other family" in reported["alien.toml"]
        assert "invalid file" in reported["none.toml"]
        assert writes(made.app) == []


async def test_search_covers_all_groups_and_continues_in_the_found_one() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        await find(made, "RFR")  # no setting
        assert screen.listed.shown_as(screen.editor).group == "Monitoring"
        await made.pilot.press("escape")
        assert screen.listed.chosen.group == "Monitoring"
        assert screen.listed.code == "RFR"
        assert screen.listed.count > 1


async def test_quitting_offers_to_save_what_is_not_in_eeprom() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        screen.session.unsaved_settings.note_write("ACC", 30, 40)
        await made.pilot.press("2")
        await arm(made.pilot)
        await made.pilot.press("q")
        await until(made.pilot, lambda: "S Save drive 1 to EEPROM first" in picture(made.app))
        assert "1 written setting is not saved to EEPROM" in " ".join(picture(made.app).split())
        await made.pilot.press("S")
        await until(made.pilot, lambda: "Save to EEPROM?" in picture(made.app))
        assert made.app.place == "parameters"
        await made.pilot.press("y")
        await message(made, "saved to EEPROM")
        assert not screen.session.unsaved
        await until(made.pilot, lambda: bool(screen.editor.eeprom and screen.editor.eeprom.last))
        await made.pilot.press("S")
        await until(made.pilot, lambda: "1 write from this computer" in picture(made.app))


@pytest.mark.sweep
async def test_s_in_write_results_asks_to_save() -> None:
    async with bench("atv71") as made:
        screen = await to_parameters(made)
        for code in ("ACC", "DEC"):
            await find(made, code)
            await stage(made, "4", f"{code} → 4.0 s")
        await arm(made.pilot)
        await made.pilot.press("w")
        await until(made.pilot, lambda: "Write 2 parameters?" in picture(made.app))
        await made.pilot.press("y")
        await until(made.pilot, lambda: isinstance(made.app.screen, Results))
        assert screen.editor.unsaved == {"ACC", "DEC"}
        lost = "Not in EEPROM, lost at power-off: ACC, DEC."
        await until(made.pilot, lambda: lost in picture(made.app))
        await made.pilot.press("S")
        await until(made.pilot, lambda: "Save to EEPROM?" in picture(made.app))
        await made.pilot.press("y")
        await message(made, "saved to EEPROM")
        assert not screen.editor.unsaved


async def test_enter_after_a_code_edits_it_and_after_words_goes_to_the_list() -> None:
    async with bench("atv312") as made:
        screen = await to_parameters(made)
        await until(made.pilot, lambda: "ACC" in screen.editor.values.raws)
        await made.pilot.press("slash", *"acc", "enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, EditNumber))
        await made.pilot.press("escape", "escape", "slash", *"ramp", "enter")
        await until(made.pilot, lambda: screen.focused is None)
        assert made.app.screen is screen
        assert screen.listed.searched


def files_of(folder: Path) -> list[Path]:
    """Parameter sets in a folder."""
    return sorted(folder.glob("*.toml"))


@pytest.mark.sweep
async def test_backup_by_one_key_is_the_newest_to_compare_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    async with bench("atv312") as made:
        await made.pilot.press("ctrl+d")
        await until(made.pilot, lambda: "No backup of this drive" in shown(made.app, "said"))
        await made.pilot.press("ctrl+k")
        await until(made.pilot, lambda: "Saved: " in shown(made.app, "said"))
        [backup] = files_of(tmp_path)
        other = read(backup).replace("device = 1", "device = 7", 1)
        write(tmp_path / "newer.toml", other)
        await made.pilot.press("ctrl+d")
        await until(made.pilot, lambda: f"{backup.name}: " in shown(made.app, "said"))
        await made.pilot.press("ctrl+k")
        await until(
            made.pilot,
            lambda: isinstance(made.app.screen, Ask) or len(files_of(tmp_path)) > 2,
        )
        assert read(backup).replace("device = 1", "device = 7", 1) == other
        assert writes(made.app) == []
