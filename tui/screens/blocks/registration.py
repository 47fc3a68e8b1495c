"""Registration of Scanner: what the panel lists, and the keys."""

from __future__ import annotations

from ..keys.action import ARMING, Registration, key_rows

REGISTERED = (
    Registration(
        title="Scanner",
        about="indirect blocks, or the communication scanner",
        digit="4",
        narrow="Scan",
        screen="blocks.screen.BlocksScreen",
        actions=(
            *ARMING,
            *key_rows(
                ("pick", "enter", "choose", "Choose the parameter that the slot is mapped to."),
                ("best", "p", "suggest", "Stage the assignment that saves most time for Monitor."),
                (
                    "write",
                    "w",
                    "write",
                    "Write the staged slots. Needs arming and standstill; asks first.",
                ),
                ("other_table", "tab,left,right", "", "Switch between inputs and outputs."),
                ("move(-1)", "up", "", "Move up one slot."),
                ("move(1)", "down", "", "Move down one slot."),
                ("shift(1)", "+", "", "Move the mapping one slot down, staged."),
                ("shift(-1)", "-", "", "Move the mapping one slot up, staged."),
                ("clear", "delete", "", "Clear the slot, staged."),
                ("undo", "u,U", "", "Discard everything staged."),
                ("verify", "V", "", "Compare each slot with direct reads."),
                ("factory", "", "", "Stage the factory assignment."),
                (
                    "exchange",
                    "X",
                    "",
                    "Write values through the output slots. Needs arming; asks first.",
                ),
                ("words", "", "", "Choose the four user words."),
                ("leave", "escape", "", "Go back to Monitor."),
            ),
        ),
    ),
)
