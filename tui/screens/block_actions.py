"""Actions of the Blocks screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from .action import BLOCKS, on

BLOCK_ACTIONS = on(
    (BLOCKS,),
    ("pick", "enter", "pick", "Choose what the slot stands for."),
    ("other_table", "tab,left,right", "", "Inputs or outputs."),
    ("move(-1)", "up", "", "One slot up."),
    ("move(1)", "down", "", "One slot down."),
    ("shift(-1)", "[", "", "Propose the slot's content one place up."),
    ("shift(1)", "]", "", "Propose the slot's content one place down."),
    ("clear", "c", "", "Propose the slot unused."),
    ("factory", "F", "", "Propose the factory assignment."),
    ("undo", "u", "", "Drop what is proposed."),
    ("write", "w", "write", "Write what is proposed; armed, motor at rest."),
    ("verify", "v", "verify", "Compare each slot with direct reads."),
    ("save", "s", "", "Save the assignment to a file."),
    ("load", "l", "", "Propose the assignment of a file."),
    ("exchange", "x", "", "Write values through the output slots; armed only."),
    ("words", "m", "", "Choose the four user words."),
    ("leave", "escape,2", "", "Go back to Monitor."),
)
