"""Scanner: the slots of an indirect block or scanner, compared, staged and written."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal

from tui.drive.blocks.assignment import describe, no_blocks
from tui.drive.blocks.slot_rules import refusing
from tui.drive.blocks.wire_cost import Saving
from tui.drive.profile.schema import Block
from tui.screens.blocks.view import (
    WIDE_SLOTS,
    cost_lines,
    slot_lines,
    stretch_lines,
    table_lines,
    user_word_lines,
)
from tui.session.blocks.proposals import monitoring_stretches, useful_codes
from tui.session.console import DriveConsole
from tui.widgets.drawing import rule, wrapped
from tui.widgets.lines import Lines

from ..keys.action import BLOCKS
from ..keys.table import bindings
from .block_keys import BlockKeys

LINES_BESIDE_SLOTS = 16
"""Lines other than slots: the frame, headings, details, cost, words, keys."""

ROWS_FOR = {"#words": 24, "#cost": 22}
"""Rows of the terminal from which user words and cost are shown: the slots come first."""
ROWS_FOR_DETAIL, SHORT_DETAIL = 18, 3
"""Rows from which a slot is shown in full, and the number of lines below that."""


class BlocksScreen(BlockKeys):
    """Two tables side by side; the block editor reads, and writes on request."""

    CSS_PATH = "blocks.tcss"
    BINDINGS: ClassVar = bindings(BLOCKS)
    TITLE = "Scanner"
    LOOK = 0.25
    AUTO_FOCUS = ""

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._side = 0
        self._at = 0

    @property
    def _block(self) -> Block | None:
        blocks = self.block_editor.proposals.blocks
        return blocks[self._side % len(blocks)] if blocks else None

    def body(self) -> ComposeResult:
        """Tables, details, cost, user words."""
        with Horizontal(id="tables"):
            yield Lines(id="first")
            yield Lines(id="second")
        yield Lines(id="detail")
        yield Lines(id="cost")
        yield Lines(id="words")

    def on_mount(self) -> None:
        """Start reading."""
        if not self.block_editor.proposals.blocks:
            for id in ("#second", "#detail", "#cost"):
                self.query_one(id).display = False
        self.block_editor.start()

    def on_unmount(self) -> None:
        """Stop reading; staged slots are kept."""
        self.block_editor.stop()

    def draw(self, width: int) -> None:
        """Draw the tables, the slot, its cost, and the user words."""
        super().draw(width)
        self.put("words", user_word_lines(self.block_editor, self.block_editor.words, width))
        if self.block_editor.proposals.blocks:
            for id, rows in ROWS_FOR.items():
                self.query_one(id).display = self.size.height >= rows
            self._show_tables(width)
        else:
            self._show_neighbors(width - 1)  # the table's margin

    def _show_tables(self, width: int) -> None:
        block_editor, block = self.block_editor, self._block
        assert block is not None
        each = (width - 1) // 2
        most = max(len(b.slots) for b in block_editor.proposals.blocks)
        double = width >= WIDE_SLOTS and self.size.height - LINES_BESIDE_SLOTS >= 2 * most
        for place, item in zip(("first", "second"), block_editor.proposals.blocks, strict=False):
            at = self._at if item is block else None
            self.put(place, table_lines(block_editor, item, each, at, double=double))
        detail = [
            rule("Slot", width, self._staged()),
            *slot_lines(block_editor, block, self._at, width),
        ]
        self.put("detail", detail if self.size.height >= ROWS_FOR_DETAIL else detail[:SHORT_DETAIL])
        self.put("cost", cost_lines(block_editor, block, block_editor.proposals.saving(), width))

    def _staged(self) -> str:
        """Return the number of staged slots with the next keys, or why nothing is read."""
        count = self.block_editor.proposals.count
        if not count:
            return self.block_editor.trouble
        return f"{count} staged. {self._keys_now()}, u to discard"

    def _keys_now(self) -> str:
        """The keys that write the staged slots, as a sentence without a full stop."""
        if self.session.arming.hindrance:
            return "Cannot be written now"
        if self._why_not_now():
            return "Stop the motor, then press w"
        return "Press w to write" if self._armed() else "Press a to arm, then w"

    def _why_not_now(self) -> str:
        """Why the staged slots cannot be written in the present state; empty if they can."""
        editor = self.block_editor
        todo = [block for block in editor.proposals.blocks if editor.proposals.changes(block)]
        return next((why for block in todo if (why := editor.not_now(block))), "")

    def _show_neighbors(self, width: int) -> None:
        why = [Text(f" {t}") for t in wrapped(no_blocks(self.session.profile), width - 2, 3)]
        head = rule("Adjacent words of the monitoring set, one request each", width)
        room = max(3, self.size.height - len(why) - 8)
        stretches = monitoring_stretches(self.session)
        found = stretch_lines(self.block_editor, stretches, width, room)
        self.put("first", [*why, Text(""), head, *found])

    # Keys that move

    def action_move(self, step: int) -> None:
        """Move the cursor by so many slots."""
        if (block := self._block) is not None:
            self._at = min(max(0, self._at + step), len(block.slots) - 1)
        self.look()

    def action_other_table(self) -> None:
        """Switch to the other table."""
        if self.block_editor.proposals.blocks:
            self._side = (self._side + 1) % len(self.block_editor.proposals.blocks)
        self.action_move(0)

    # Keys that stage

    def action_pick(self) -> None:
        """Choose the parameter that the slot is mapped to."""
        from ..dialogs.pick_parameter import PickParameter

        block, place = self._block, self._at
        if block is None:
            self._refuse(no_blocks(self.session.profile))
            return

        def reported(code: str | None) -> None:
            if code is not None:
                self._try(lambda: self.block_editor.proposals.pick(block, place, code))

        slot = block.slots[place]
        useful = useful_codes(self.block_editor.proposals, block)
        self.app.push_screen(PickParameter(self.session.profile, block, slot, useful), reported)

    def action_shift(self, step: int) -> None:
        """Move the slot's mapping by so many slots, staged."""
        block, place = self._block, self._at
        if block is not None and 0 <= place + step < len(block.slots):
            self._try(lambda: self.block_editor.proposals.move(block, place, step))
            self.action_move(step)

    def action_clear(self) -> None:
        """Clear the slot, staged."""
        if (block := self._block) is not None:
            self._try(lambda: self.block_editor.proposals.clear(block, self._at))

    def action_factory(self) -> None:
        """Stage the factory assignment."""

        def work() -> None:
            for block in self.block_editor.proposals.blocks:
                self.block_editor.proposals.factory(block)

        self._try(work)

    def action_best(self) -> None:
        """Stage the assignment that saves most time for Monitor."""
        found: list[Saving | None] = []
        self._try(lambda: found.append(self.block_editor.proposals.best()))
        if found and found[0] is not None:
            # without figures: those below the tables change with the measured line
            self.app.tell("Staged the assignment that saves most time for Monitor.")
            how = self._why_not_now() or self.how_to_write("it")
            self.hint_keys(f"{how} Press u to discard it.")
        elif found:
            self.app.tell("Nothing to suggest: no other assignment shortens Monitor's cycle.")

    def action_undo(self) -> None:
        """Discard all staged slots."""
        self.block_editor.proposals.drop()
        self.look()

    # Keys that write

    def action_verify(self) -> None:
        """Compare every slot with direct reads, several times."""
        if self.block_editor.proposals.blocks:
            self.block_editor.verify()
        self.look()

    def action_write(self) -> None:
        """Ask, then write the staged slots."""
        block_editor = self.block_editor
        proposals = block_editor.proposals
        todo = [block for block in proposals.blocks if proposals.changes(block)]
        if not todo:
            self._refuse("Nothing is staged.")
            self.hint_keys("Press Enter to choose a parameter for the slot.")
            return
        wrong = [p.text for block in todo for p in refusing(proposals.problems(block))]
        wrong += [text for block in todo if (text := block_editor.not_now(block))]
        if wrong:
            self._refuse(wrong[0])
            return
        if not self._may_write():
            return

        slots = "1 slot" if proposals.count == 1 else f"{proposals.count} slots"
        self._ask(
            f"Write {slots}?",
            self._follows(),
            "Write and read back",
            "Cancel",
            block_editor.write_proposals,
        )

    def _follows(self) -> str:
        """Return the pending writes and their consequences."""
        profile, lines, reported = self.session.profile, [], []
        for block in self.block_editor.proposals.blocks:
            found = self.block_editor.proposals.changes(block)
            lines += [
                f"{c.slot}: {describe(profile, block, c.old)} → {describe(profile, block, c.new)}"
                for c in found
            ]
            if found and block.effective == "after-reset":
                reported.append("It takes effect after the drive's next reset or power-up.")
            if found and any(profile[s].storage == "ram-until-saved" for s in block.slots):
                reported.append("Lost at power-off until saved (S).")
            if found and block.direction == "write":
                reported.append("A master's writes to these outputs then reach other parameters.")
        reported.append(
            "Another master on this line may use the present assignment. Change its program, too."
        )
        return "\n".join([*lines[:8], *([" …"] if len(lines) > 8 else []), "", *reported])
