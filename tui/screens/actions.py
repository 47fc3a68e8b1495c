"""Every action of the panel in one place: its key, its words, the screens it belongs to.

Bindings, the line of keys, the help screen and the command palette are made from this table.
"""

from __future__ import annotations

from textual.binding import Binding, BindingType

from .action import (
    BLOCKS,
    CONNECTION,
    EVERYWHERE,
    FAULTS,
    FRAMES,
    MONITOR,
    PARAMETERS,
    SOURCES,
    Action,
)
from .block_actions import BLOCK_ACTIONS
from .parameter_actions import PARAMETER_ACTIONS

ACTIONS: tuple[Action, ...] = (
    Action(
        "stop_by_space",
        "space",
        "Space",
        "STOP",
        "Stop the motor on its ramp, wherever no text is being typed.",
        app=True,
        first=True,
    ),
    Action(
        "stop",
        "f12",
        "F12",
        "",
        "Stop the motor on its ramp, from any screen, dialog or text.",
        app=True,
        line=False,
        first=True,
    ),
    Action(
        "stop_all",
        "f9",
        "F9",
        "",
        "Stop every drive of the line on its ramp, from any screen.",
        app=True,
        line=False,
        first=True,
    ),
    Action(
        "open_chosen", "enter", "Enter", "open", "Open the chosen line or drive.", (CONNECTION,)
    ),
    Action("scan", "s", "s", "scan", "Look for drives at the addresses given.", (CONNECTION,)),
    Action(
        "type_line",
        "n",
        "n",
        "type line",
        "Type a line: serial, TCP, RTU over TCP, sim.",
        (CONNECTION,),
    ),
    Action(
        "refresh_lines", "r", "r", "", "Look for serial ports again.", (CONNECTION,), line=False
    ),
    Action("disconnect", "x", "x", "close", "Close the line.", (CONNECTION,)),
    Action(
        "stop_scan",
        "escape",
        "Esc",
        "stop scan",
        "Stop looking for drives.",
        (CONNECTION,),
        line=False,
    ),
    Action(
        "watch_chosen",
        "2",
        "2",
        "",
        "Go to Monitor of the chosen drive.",
        (CONNECTION,),
        line=False,
    ),
    Action(
        "arm",
        "a",
        "a",
        "arm",
        "Arm this drive, or end that.",
        (MONITOR, SOURCES, PARAMETERS, BLOCKS),
    ),
    Action("order('forward')", "r", "r", "run", "Run forward.", (MONITOR,)),
    Action("order('reverse')", "v", "v", "reverse", "Run reverse.", (MONITOR,)),
    Action("reference", "f", "f", "ref", "Type a reference in Hz or rpm.", (MONITOR,)),
    Action("order('reset')", "x", "x", "reset", "Reset a fault; runs nothing.", (MONITOR,)),
    Action(
        "step_reference(1)", "up", "Up", "", "Raise the reference by 1 Hz.", (MONITOR,), line=False
    ),
    Action(
        "step_reference(-1)",
        "down",
        "Down",
        "",
        "Lower the reference by 1 Hz.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "step_reference(5)",
        "pageup",
        "PgUp",
        "",
        "Raise the reference by 5 Hz.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "step_reference(-5)",
        "pagedown",
        "PgDn",
        "",
        "Lower the reference by 5 Hz.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "options",
        "o",
        "o",
        "",
        "Choose a ramp, preset speed, motor or output.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "stop_as('quick-stop')",
        "k",
        "k",
        "",
        "Quick stop, where the drive has one; needs no arming.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "stop_as('freewheel')",
        "z",
        "z",
        "",
        "Let the motor coast; needs no arming.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "stop_as('emergency-stop')",
        "e",
        "e",
        "",
        "Emergency stop with a fault (Altivar 21); needs no arming.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "order('dc-braking')",
        "b",
        "b",
        "",
        "Brake by direct current, where the drive has an order for it.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "order('take-control')",
        "t",
        "t",
        "",
        "Take the control from the terminals (Leroy-Somer 6.43), locked only.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "hand_back",
        "g",
        "g",
        "",
        "Give the control back to the terminals; a run order waiting there counts then.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "control_source",
        "c",
        "c",
        "",
        "See and set up who commands the drive.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "write_chosen",
        "",
        "Enter",
        "write",
        "Write the chosen configuration, armed and with the motor at rest.",
        (SOURCES,),
    ),
    Action(
        "faults",
        "h",
        "h",
        "",
        "Faults: the last trip, the drive's history and what it stored.",
        (MONITOR,),
        line=False,
    ),
    Action("save", "s", "s", "save", "Save the record of the trip to a file.", (FAULTS,)),
    Action("move_record(1)", "left_square_bracket", "[", "older", "Older values.", (FAULTS,)),
    Action("move_record(-1)", "right_square_bracket", "]", "newer", "Newer values.", (FAULTS,)),
    Action("leave", "escape,h,2", "Esc", "back", "Go back to Monitor.", (FAULTS,)),
    Action("leave", "escape,c,2", "Esc", "back", "Go back to Monitor.", (SOURCES,)),
    Action("parameters", "3", "3", "", "Parameters of this drive.", (MONITOR,), line=False),
    *PARAMETER_ACTIONS,
    Action("blocks", "4", "4", "", "Indirect blocks or scanner.", (MONITOR,), line=False),
    *BLOCK_ACTIONS,
    Action("leave", "escape,1", "Esc", "", "Go back to Connection.", (MONITOR,), line=False),
    Action(
        "step_drive(-1)",
        "left_square_bracket",
        "[",
        "",
        "The drive before on this line.",
        (MONITOR,),
        line=False,
    ),
    Action(
        "step_drive(1)",
        "right_square_bracket",
        "]",
        "drive",
        "The next drive on this line.",
        (MONITOR,),
        both="[ ]",
        line=False,
    ),
    Action(
        "change_rate(1)", "plus,equals_sign", "+", "", "Poll twice as fast.", (MONITOR,), line=False
    ),
    Action("change_rate(-1)", "minus", "-", "", "Poll half as fast.", (MONITOR,), line=False),
    Action("next_word", "w", "w", "", "Show the next word of bits.", (MONITOR,), line=False),
    Action(
        "rating",
        "i",
        "i",
        "",
        "Tell the rated current of a drive that gives its current in %.",
        (MONITOR,),
        line=False,
    ),
    Action("frames", "l", "l", "", "Show the frames on the line.", (MONITOR,), line=False),
    Action("leave", "escape,l,2", "Esc", "back", "Go back to Monitor.", (FRAMES,)),
    Action("hold", "h", "h", "hold", "Hold the list still, or let it run.", (FRAMES,)),
    Action("command_palette", "ctrl+p", "^p", "all", "Find any action by its name.", app=True),
    Action("help", "question_mark,f1", "?", "help", "Show every key.", app=True),
    Action("quit", "q,ctrl+q", "q", "leave", "Leave the panel.", app=True),
)


def bindings(screen: str | None) -> list[BindingType]:
    """Textual's bindings of a screen, or of the app for None."""
    return [
        Binding(
            action.keys,
            action.id,
            action.label or action.help,
            show=False,
            id=f"{screen or 'app'}.{action.id}",
            tooltip=action.help,
            priority=action.first,
        )
        for action in ACTIONS
        if action.keys
        and action.app == (screen is None)
        and (screen is None or screen in action.screens)
    ]


def of_screen(screen: str) -> list[Action]:
    """Actions that work on a screen: the stop first, then the screen's own and the app's."""
    return [action for action in ACTIONS if screen in action.screens]


def line_of(screen: str) -> list[tuple[str, str, str]]:
    """Action, key and label of everything in the line of keys of a screen."""
    return [
        (action.id, action.both or action.shown, action.label)
        for action in of_screen(screen)
        if action.line
    ]


def keys_of(screen: str) -> list[tuple[str, str]]:
    """What the line of keys says on a screen."""
    return [(key, label) for _, key, label in line_of(screen)]


__all__ = [
    "ACTIONS",
    "BLOCKS",
    "CONNECTION",
    "EVERYWHERE",
    "FAULTS",
    "FRAMES",
    "MONITOR",
    "PARAMETERS",
    "SOURCES",
    "Action",
    "bindings",
    "keys_of",
    "line_of",
    "of_screen",
]
