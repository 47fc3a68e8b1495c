"""Blocks and scanner by keys: simulated drives over a real line, the whole panel above."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from textual.widgets import Input, OptionList

from tests.sweeps import kept
from tui.drive.blocks.wire_cost import Cost, Saving
from tui.drive.profile import library
from tui.drive.settings.writable import AT_REST
from tui.screens.blocks.block_keys import BlockKeys
from tui.screens.blocks.screen import BlocksScreen
from tui.screens.blocks.view import cost_lines, table_lines
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.control.screen import ControlSourceScreen
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.pick_parameter import PickParameter
from tui.screens.faults.screen import FaultsScreen
from tui.screens.frames.screen import FramesScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.screen import ParametersScreen
from tui.session.blocks.editor import BlockEditor
from tui.session.blocks.proposals import Proposals

from .fakes import press
from .test_block_pictures import proposed, scanner
from .test_command_flows import Bench, bench
from .test_flows import arm, picture, shown, until
from .test_parameter_flows import open_file
from .walk import every_step

pytestmark = pytest.mark.long


async def to_blocks(made: Bench, sees: str = "ETA") -> None:
    await made.pilot.press("4")
    await until(made.pilot, lambda: isinstance(made.app.screen, BlocksScreen))
    await until(made.pilot, lambda: sees in shown(made.app, "first"))


async def message(made: Bench, *parts: str) -> None:
    def output() -> str:
        return " ".join(f"{shown(made.app, 'said')} {shown(made.app, 'detail')}".split())

    await until(made.pilot, lambda: all(part in output() for part in parts))


def block_editor(made: Bench) -> BlockEditor:
    screen = made.app.screen
    assert isinstance(screen, BlocksScreen)
    return screen.block_editor


async def pick(made: Bench, typed: str) -> None:
    await made.pilot.press("enter")
    await until(made.pilot, lambda: isinstance(made.app.screen, PickParameter))
    await made.pilot.press(*typed, "enter")
    await until(made.pilot, lambda: isinstance(made.app.screen, BlocksScreen))


async def answer(made: Bench, key: str, text: str) -> None:
    await press(made.pilot, key)
    await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
    made.app.screen.query_one(Input).value = text
    await made.pilot.press("enter")


async def write(made: Bench) -> None:
    await made.pilot.press("w")
    await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
    assert "Another master" in str(made.app.screen.query_one("#follows").render())
    await made.pilot.press("y")


@pytest.mark.sweep
async def test_slots_are_picked_moved_written_and_verified() -> None:
    async with bench("atv71") as made:
        await to_blocks(made)
        await made.pilot.press("down", "down")
        await until(made.pilot, lambda: "  unused" in shown(made.app, "detail"))
        assert "mapped to" not in shown(made.app, "detail")
        await pick(made, "lcr")
        await until(made.pilot, lambda: "→ LCR" in shown(made.app, "first"))
        await arm(made.pilot)
        await made.pilot.press("w")
        await until(made.pilot, lambda: "Write 1 slot?" in picture(made.app))
        await made.pilot.press("escape", "A", "minus")
        await message(made, "2 staged")
        assert made.drive().raw("NMA2") == 8604
        await made.pilot.press("w")
        await message(made, "Not armed")
        await arm(made.pilot)
        await until(made.pilot, lambda: " ARMED" in shown(made.app, "strip"))
        await write(made)
        await message(made, "Wrote NMA2, NMA3, all verified", "Lost at power-off")
        assert [made.drive().raw(f"NMA{n}") for n in (1, 2, 3)] == [3201, 3204, 8604]
        # Parameters was never opened: losses at power-off are still reported
        await until(made.pilot, lambda: "3▲Parameters" in shown(made.app, "tabs"))
        await made.pilot.press("q")
        await until(made.pilot, lambda: "2 written settings are not saved" in picture(made.app))
        await made.pilot.press("escape")
        await made.pilot.press("V")
        await message(made, "3 slots match direct reads")
        await press(made.pilot, "(factory)")
        await message(made, "2 staged")
        await made.pilot.press("u", "escape")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))


async def test_running_motor_blocks_writing_and_stop_works() -> None:
    async with bench("atv71") as made:
        await made.running()
        await to_blocks(made)
        await made.pilot.press("down", "down", "down")
        await pick(made, "otr")
        await made.pilot.press("w")
        await message(made, "only with the motor stopped", "Stop it first")
        assert isinstance(made.app.screen, BlocksScreen)
        assert made.drive().raw("NMA4") == 0
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickParameter))
        await made.pilot.press("f12")
        await made.stopped()


async def test_change_by_another_source_is_detected_and_not_overwritten() -> None:
    async with bench("atv71") as made:
        await to_blocks(made)
        await arm(made.pilot)
        await made.pilot.press("down", "down")
        await pick(made, "lcr")
        made.drive().set("NMA1", 9001)
        await until(made.pilot, lambda: "ACC" in shown(made.app, "first"))
        await write(made)
        await message(made, "Another program changed NMA1")
        assert made.drive().raw("NMA1") == 9001
        # after the message, it may be overwritten
        await until(made.pilot, lambda: "→ ETA" in shown(made.app, "first"))
        await until(made.pilot, lambda: not block_editor(made).busy)
        await write(made)
        await message(made, "Wrote NMA1, NMA3, all verified")


async def test_assignment_is_saved_and_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    async with bench("atv71") as made:
        await to_blocks(made)
        file = tmp_path / "scanner.toml"
        await answer(made, "ctrl+s", str(file))
        await until(made.pilot, file.exists)
        text = file.read_text("utf-8")
        file.write_text(text.replace('NMA3 = "none"', 'NMA3 = "LCR"'), "utf-8")
        await open_file(made, file)
        await until(made.pilot, lambda: "→ LCR" in shown(made.app, "first"))
        await made.pilot.press("u")
        file.write_text(text.replace('NMA3 = "none"', 'NMA3 = "NOPE"'), "utf-8")
        await open_file(made, file)
        await message(made, "scanner.toml:", "NMA3")


async def test_outputs_are_written_only_if_armed() -> None:
    async with bench("atv71") as made:
        await to_blocks(made)
        for slot, code in {"NCA1": "ACC", "NCA2": "DEC"}.items():
            made.drive().set(slot, made.drive().profile[code].address)
        await until(made.pilot, lambda: "DEC" in shown(made.app, "second"))
        await made.pilot.press("X")
        await message(made, "Not armed")
        await arm(made.pilot)
        await answer(made, "X", "ACC=5.5")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await message(made, "Wrote ACC 5.5", "The reply has ETA")
        assert made.drive().raw("ACC") == 55


async def test_user_words_are_kept_for_the_drive() -> None:
    async with bench("atv71") as made:
        made.drive().set("ACC", 37)
        await to_blocks(made)
        await answer(made, "(words)", "acc unsigned, W3199 hex")
        await until(made.pilot, lambda: "ACC 37" in shown(made.app, "words"))
        assert "W3199 -----" in shown(made.app, "words")
        await press(made.pilot, "(words)")
        await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
        made.app.screen.query_one(Input).value = "ACC octal"
        await made.pilot.press("enter")
        fault = made.app.screen.query_one("#fault")
        await until(made.pilot, lambda: "not a format" in str(fault.render()))


async def test_indirect_block_waits_for_a_reset() -> None:
    async with bench("atv21") as made:
        await to_blocks(made, "F875")
        await until(made.pilot, lambda: "unused" in shown(made.app, "first"))
        await pick(made, "fd01")
        await made.pilot.press("down")
        await pick(made, "fd00")
        await arm(made.pilot)
        await write(made)
        await message(made, "after the drive's next reset")
        await until(made.pilot, lambda: "pending" in shown(made.app, "first"))
        # until then the cycle is that of before
        assert " after a reset" in shown(made.app, "cost")
        made.drive().power_cycle()
        await until(made.pilot, lambda: "F875 FD01" in shown(made.app, "first"))


@pytest.mark.sweep
async def test_outputs_of_an_indirect_block_wait_for_a_reset_and_confirmation() -> None:
    async with bench("atv21") as made:
        await to_blocks(made, "F875")
        await made.pilot.press("tab", "a")
        await pick(made, "fa50")
        await made.pilot.press("down")
        await pick(made, "fa51")
        await write(made)
        await message(made, "after the drive's next reset")
        await made.pilot.press("X")
        await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
        made.app.screen.query_one(Input).value = "FA51=500"
        await made.pilot.press("enter")
        fault = made.app.screen.query_one("#fault")
        await until(made.pilot, lambda: "Reset the drive first" in str(fault.render()))
        await made.pilot.press("escape")
        made.drive().power_off()
        await until(made.pilot, lambda: not block_editor(made).mapper.written)
        made.drive().power_on()
        await until(made.pilot, lambda: not block_editor(made).trouble)
        await until(made.pilot, lambda: "pending" not in shown(made.app, "second"))
        await answer(made, "X", "FA51=500")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        assert "cannot be read" in str(made.app.screen.query_one("#follows").render())
        await made.pilot.press("y")
        events = made.app.events  # the newest may be that replies were lost while it was off
        await until(made.pilot, lambda: any("Wrote FA51 500" in e.text for e in events.events))
        assert made.drive().raw("FA51") == 500


@pytest.mark.parametrize("family", kept(["atv312", "powerdrive"], "powerdrive"))
async def test_family_without_blocks_says_so_and_ignores_keys(family: str) -> None:
    async with bench(family) as made:
        await to_blocks(made, "neither")
        keys = ("enter", "tab", "delete", "plus", "minus", "w", "V", "X", "u", "ctrl+o", "ctrl+s")
        for key in (*keys, "(factory)", "right_square_bracket"):
            await press(made.pilot, key)
        assert isinstance(made.app.screen, BlocksScreen)
        await made.pilot.press("2")
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))


@pytest.mark.sweep
async def test_every_drive_screen_is_one_key_from_every_other() -> None:
    async with bench("atv71") as made:
        places = {
            "1": ConnectionScreen,
            "2": MonitorScreen,
            "3": ParametersScreen,
            "4": BlocksScreen,
            "5": FaultsScreen,
            "6": ControlSourceScreen,
            "7": FramesScreen,
        }
        here = "2"
        for key in every_step(places):
            screen = made.app.screen
            await made.pilot.press(key)
            await until(made.pilot, lambda key=key: isinstance(made.app.screen, places[key]))  # type: ignore[misc]
            assert (made.app.screen is screen) is (key == here), (here, key)
            here = key
            assert len(made.app.screen_stack) <= 4


async def test_p_names_the_keys_that_write_the_suggestion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def best(proposals: Proposals) -> Saving:
        proposals.pick(proposals.blocks[0], 2, "LCR")
        return Saving(Cost(50_000, 3), Cost(30_000, 2))

    monkeypatch.setattr(Proposals, "best", best)
    # on a busy machine a message is older than that before the test looks
    monkeypatch.setattr("tui.screens.frame.WHOLE_FOR", 1e9)
    async with bench("atv71") as made:
        await made.running()
        await to_blocks(made)
        # the keys that are named depend on the state that the panel has seen
        await until(made.pilot, lambda: "FORWARD" in shown(made.app, "strip"))
        await made.pilot.press("p")
        await message(
            made, "Staged the assignment", "with the motor stopped", "Press u to discard it."
        )
        assert "w to write" not in shown(made.app, "said")
        await until(made.pilot, lambda: "Stop the motor, then press w" in shown(made.app, "detail"))
        await made.pilot.press("space", "u")
        await until(made.pilot, lambda: made.speed() == 0)
        watched = block_editor(made).monitor
        await until(made.pilot, lambda: watched.latest.state.motion in AT_REST)  # type: ignore[union-attr]
        # the message of the stop would take the place of the next one
        await message(made, "The motor is stopped")
        await made.pilot.press("p")
        await message(made, "Press a to arm, then w to write it.")
        await until(made.pilot, lambda: "Press a to arm, then w" in shown(made.app, "detail"))
        await arm(made.pilot)
        await made.pilot.press("u", "p")
        await message(made, "Press w to write it.")
        await until(
            made.pilot, lambda: "Press w to write, u to discard" in shown(made.app, "detail")
        )
        # on another screen u and w are other keys, and the message stays here
        await made.pilot.press("3")
        await until(made.pilot, lambda: made.app.place == "parameters")
        await until(made.pilot, lambda: "Staged" not in shown(made.app, "said"))
        assert "Press" not in shown(made.app, "said")


@pytest.mark.parametrize("width", [60, 80, 120, 200])
@pytest.mark.parametrize("slots", [lambda _: None, proposed], ids=["now", "staged"])
def test_costs_and_values_of_slots_are_not_cut(
    slots: Callable[[BlockEditor], None], width: int
) -> None:
    editor = scanner()
    slots(editor)
    block = editor.proposals.blocks[0]
    costs = Saving(Cost(158_300, 13), Cost(158_300, 12))
    table = table_lines(editor, block, width // 2, None, double=False)
    lines = [*cost_lines(editor, block, costs, width), *table]
    assert [line.plain for line in lines if "…" in line.plain] == []
    assert ("(+0.0 ms)" in lines[1].plain) == (slots is proposed)


@pytest.mark.parametrize("after", [30_000, 30_049, 30_050, 30_051, 29_951])
@pytest.mark.parametrize("before", [50_000, 50_049, 50_050, 50_051])
def test_shown_saving_is_the_difference_of_the_shown_costs(before: int, after: int) -> None:
    editor = scanner()
    proposed(editor)
    costs = Saving(Cost(before, 3), Cost(after, 2))
    line = cost_lines(editor, editor.proposals.blocks[0], costs, 120)[1].plain
    first, second, change = (float(text) for text in re.findall(r"([-+]?[\d.]+) ms", line)[:3])
    assert change == pytest.approx(second - first, abs=0.01)


async def test_list_for_a_slot_begins_with_monitored_values_that_no_slot_maps() -> None:
    async with bench("atv71") as made:
        await to_blocks(made)
        await made.pilot.press("down", "down", "enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickParameter))
        options = made.app.screen.query_one(OptionList)
        codes = [str(option.prompt).split()[0] for option in options.options]
        assert codes[:2] == ["RFR", "LCR"]
        assert codes.count("LCR") == 1
        first = codes.index("none")
        assert not {"ETA", "RFRD"} & set(codes[:first])  # mapped by the factory assignment
        assert "ETA" in codes[first:]
        await made.pilot.press("down", "enter")
        await until(made.pilot, lambda: "LCR" in shown(made.app, "first"))
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickParameter))
        again = made.app.screen.query_one(OptionList)
        assert "LCR" not in [str(o.prompt).split()[0] for o in again.options][:first]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "0 hex, 0 hex, 0 hex, 0 hex"),
        ("LCR signed, W7121, none", "3204 signed, 7121 hex, 0 hex, 0 hex"),
        ("3204, ETA bits, LCR, LCR, LCR", "3204 hex, 3201 bits, 3204 hex, 3204 hex"),
    ],
)
def test_typed_user_words_are_hexadecimal_by_default(text: str, words: str) -> None:
    screen: Any = SimpleNamespace(session=SimpleNamespace(profile=library.load("atv71")))
    found = BlockKeys._words_typed(screen, text)
    assert ", ".join(f"{word.address} {word.format}" for word in found) == words
