"""Actions of the Blocks screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from .action import BLOCKS, on

BLOCK_ACTIONS = on(
    (BLOCKS,),
    ("pick", "enter", "pick", "Choose what the slot is mapped to."),
    ("best", "p", "best", "Propose the slots that save most for what Monitor shows."),
    ("write", "w", "write", "Write what is proposed; armed, motor at rest, asks."),
    ("other_table", "tab,left,right", "", "Inputs or outputs."),
    ("move(-1)", "up", "", "One slot up."),
    ("move(1)", "down", "", "One slot down."),
    ("shift(1)", "+", "", "Propose the slot's content one place down."),
    ("shift(-1)", "-", "", "Propose the slot's content one place up."),
    ("clear", "delete", "", "Propose the slot unused."),
    ("undo", "u,U", "", "Drop what is proposed."),
    ("verify", "V", "", "Compare each slot with direct reads."),
    ("factory", "", "", "Propose the factory assignment."),
    ("exchange", "X", "", "Write values through the output slots; armed, asks."),
    ("words", "", "", "Choose the four user words."),
    ("leave", "escape", "", "Go back to Monitor."),
)
