"""Pictures of the Blocks screen in its main states, at both sizes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.drive.blocks.assignment import slot_target
from tui.drive.blocks.user_words import UserWord
from tui.drive.profile import library
from tui.drive.profile.schema import Block
from tui.screens.blocks.screen import BlocksScreen
from tui.session.blocks.editor import BlockEditor
from tui.session.blocks.mapping import BlockView, Force, Slot
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.read.proof import SlotMatch
from tui.session.work import Outcome, OutcomeKind

from . import fakes
from .test_pictures import SIZES, Compare

INPUTS = (3201, 8604, 3204, 3205, 3207, 3209, 9630, 0)
OUTPUTS = (8501, 8602, 3104, 3105, 9001, 9002, 0, 0)
HELD = {**fakes.READY, "CMD": 0, "LFRD": 0, "HSP": 500, "LSP": 0, "ACC": 30, "DEC": 30, "INR": 1}
ATV21 = {"FD01": 0x6404, "FD00": 3500, "FE03": 812, "FE05": 7000, "FE90": 1050, "FC91": 0}


class StillDesk(BlockEditor):
    """A block editor whose values do not change."""

    def start(self) -> None:
        """Nothing is read."""

    def stop(self) -> None:
        """Nothing was read."""

    def _say(self, text: str, kind: OutcomeKind) -> None:
        """Said at the moment of every fake."""
        self.session.work.outcome = Outcome(kind, text, fakes.NOW)


def desk_on(family: str) -> StillDesk:
    """The block editor of a drive that is ready, where its family has blocks."""
    held = fakes.snapshot_of(library.load("atv71"), fakes.READY) if family == "atv71" else None
    console = fakes.console_of(held, family=family)
    return StillDesk(console.session, console.monitor, console.journal)


def hold(session: DriveSession, raws: Mapping[str, int]) -> None:
    """The drive was read and holds this."""
    for code, raw in raws.items():
        session.image.confirm(code, raw, fakes.NOW)


def view_of(
    session: DriveSession, block: Block, raws: tuple[int, ...], held: Mapping[str, int]
) -> BlockView:
    """Slots that all return the values of their parameters."""
    profile = session.profile
    hold(session, dict(zip(block.slots, raws, strict=True)))
    slots = []
    for code, raw in zip(block.slots, raws, strict=True):
        parameter = slot_target(profile, block, raw)
        if parameter is None:
            verdict = SlotMatch.UNUSED if raw == 0 else SlotMatch.NONE
            slots.append(Slot(code, raw, verdict=verdict))
            continue
        reading = fakes.readings_of(
            profile, {**held, parameter.code: held.get(parameter.code, 0)}, fakes.NOW
        )[parameter.code]
        text = f"{reading.text} {reading.unit}".strip()
        force = Force.ACTIVE if block.effective == "at-once" else Force.UNPROVED
        slots.append(Slot(code, raw, parameter, reading.raw, text, reading, SlotMatch.SAME, force))
    return BlockView(block, tuple(slots))


def scanner() -> BlockEditor:
    block_editor = desk_on("atv71")
    session = block_editor.session
    hold(session, {"INR": 1})
    first, second = block_editor.proposals.blocks
    block_editor.views = {
        first.id: view_of(session, first, INPUTS, HELD),
        second.id: view_of(session, second, OUTPUTS, HELD),
    }
    block_editor.words = (
        UserWord(3204, "signed"), UserWord(3205, "signed"), UserWord(7121), UserWord(),
    )  # fmt: skip
    block_editor.word_raws = [53, 725, 0, None]
    return block_editor


def proposed(block_editor: BlockEditor) -> None:
    first = block_editor.proposals.blocks[0]
    block_editor.proposals.pick(first, 7, "LFT")
    block_editor.proposals.move(first, 2, 1)


def wrong(block_editor: BlockEditor) -> None:
    block_editor.proposals.pick(block_editor.proposals.blocks[1], 6, "CMD")


def differs(block_editor: BlockEditor) -> None:
    block = block_editor.proposals.blocks[0]
    view = block_editor.views[block.id]
    bad = Slot("NMA1", 3201, view.slots[0].parameter, 1480, "raw 1480", view.slots[0].direct,
               SlotMatch.DIFFERS, Force.ACTIVE)  # fmt: skip
    unknown = Slot("NMA2", 3199, None, None, verdict=SlotMatch.NONE)
    hold(block_editor.session, {"NMA2": 3199})
    block_editor.views[block.id] = BlockView(block, (bad, unknown, *view.slots[2:]))
    block_editor.refuse("NMA1 differs; NMA2 no value. 5 slots match direct reads.")


def indirect() -> BlockEditor:
    block_editor = desk_on("atv21")
    session = block_editor.session
    first, second = block_editor.proposals.blocks
    view = view_of(session, first, (1, 2, 3, 4, 11), ATV21)
    active = tuple(
        Slot(s.code, s.raw, s.parameter, s.word, s.text, s.direct, s.verdict, Force.ACTIVE)
        for s in view.slots[:3]
    )
    pending = tuple(
        Slot(s.code, s.raw, s.parameter, 77, "raw 77", s.direct, SlotMatch.DIFFERS,
             Force.PENDING, "FC91")
        for s in view.slots[3:]
    )  # fmt: skip
    block_editor.views = {
        first.id: BlockView(first, (*active, *pending)),
        second.id: BlockView(
            second,
            view_of(session, second, (1, 3), {"FA00": 0, "FA01": 0}).slots,
            "Write block can only be written: its words cannot be read.",
        ),
    }
    return block_editor


def empty() -> BlockEditor:
    return desk_on("atv71")


def without(family: str) -> Callable[[], BlockEditor]:
    return lambda: desk_on(family)


def nothing(_: BlockEditor) -> None:
    """As it is."""


STATES: dict[str, tuple[Callable[[], BlockEditor], Any, float | None, list[str]]] = {
    "scanner": (scanner, nothing, None, []),
    "outputs": (scanner, nothing, 52.0, ["tab", "down", "down"]),
    "proposed": (scanner, proposed, 52.0, ["down", "down"]),
    "write": (scanner, proposed, 52.0, ["w"]),
    "not-armed": (scanner, proposed, None, ["w"]),
    "wrong": (scanner, wrong, 52.0, ["tab", *["down"] * 6, "w"]),
    "differs": (scanner, differs, None, []),
    "pick": (scanner, nothing, None, ["down", "enter"]),
    "pick-found": (scanner, nothing, None, ["down", "enter", *"current"]),
    "pick-nothing": (scanner, nothing, None, ["down", "enter", *"xyz"]),
    "words": (scanner, nothing, None, ["(words)"]),
    "exchange": (scanner, nothing, 52.0, ["X", *"ACC=5.0"]),
    "exchange-sure": (scanner, nothing, 52.0, ["X", *"ACC=5.0", "enter"]),
    "indirect": (indirect, nothing, None, ["down", "down", "down"]),
    "indirect-outputs": (indirect, nothing, None, ["tab"]),
    "reading": (empty, nothing, None, []),
    "none": (without("atv312"), nothing, None, []),
    "neighbors": (without("powerdrive"), nothing, None, []),
    "help": (scanner, nothing, None, ["question_mark"]),
}


def panel(state: str) -> tuple[DrivePanelApp, DriveConsole]:
    """The panel on a drive with blocks in a state."""
    make, prepare, armed, _ = STATES[state]
    block_editor = make()
    prepare(block_editor)
    app = fakes.app_of(kind=fakes.Easel)
    app.opened = fakes.opened()
    block_editor.session.arming = block_editor.session.work.arming = fakes.StillArming(
        block_editor.session.line, armed
    )
    console = DriveConsole(block_editor.session, block_editor.journal)
    console.blocks, console.monitor = block_editor, block_editor.monitor
    fakes.choose(app, console)
    return app, console


@SIZES
@pytest.mark.parametrize(
    "state",
    kept(STATES, "scanner", "write", "wrong", "exchange", "exchange-sure", "outputs", "indirect"),
)
def test_blocks(
    snap_compare: Compare, state: str, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")
    app, console = panel(state)
    keys = STATES[state][3]

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(BlocksScreen(console))
        await pilot.pause()
        await fakes.press(pilot, *keys)
        await pilot.pause()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)
