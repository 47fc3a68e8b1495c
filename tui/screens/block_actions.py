"""Actions of the Blocks screen."""

from __future__ import annotations

from .action import BLOCKS, Action

HERE = (BLOCKS,)

BLOCK_ACTIONS: tuple[Action, ...] = (
    Action("pick", "enter", "Enter", "pick", "Choose what the slot stands for.", HERE),
    Action("other_table", "tab,left,right", "Tab", "", "Inputs or outputs.", HERE, line=False),
    Action("move(-1)", "up", "Up", "", "One slot up.", HERE, line=False),
    Action("move(1)", "down", "Down", "", "One slot down.", HERE, line=False),
    Action(
        "shift(-1)",
        "left_square_bracket",
        "[",
        "",
        "Propose the slot's content one place up.",
        HERE,
        line=False,
    ),
    Action(
        "shift(1)",
        "right_square_bracket",
        "]",
        "",
        "Propose the slot's content one place down.",
        HERE,
        line=False,
    ),
    Action("clear", "c", "c", "", "Propose the slot unused.", HERE, line=False),
    Action("factory", "F", "F", "", "Propose the factory assignment.", HERE, line=False),
    Action("undo", "u", "u", "", "Drop what is proposed.", HERE, line=False),
    Action("write", "w", "w", "write", "Write what is proposed; armed, motor at rest.", HERE),
    Action("verify", "v", "v", "verify", "Compare each slot with direct reads.", HERE),
    Action("save", "s", "s", "", "Save the assignment to a file.", HERE, line=False),
    Action("load", "l", "l", "", "Propose the assignment of a file.", HERE, line=False),
    Action(
        "exchange",
        "x",
        "x",
        "",
        "Write values through the output slots; armed only.",
        HERE,
        line=False,
    ),
    Action("words", "m", "m", "", "Choose the four user words.", HERE, line=False),
    Action("leave", "escape,2", "Esc", "", "Go back to Monitor.", HERE, line=False),
)
