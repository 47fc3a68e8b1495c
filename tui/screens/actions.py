"""Every action of the panel in one place: its key, its words, the screens it belongs to.

Bindings, the line of keys, the help screen and the command palette are made from this table.
"""

from __future__ import annotations

from functools import partial

from textual.binding import Binding, BindingType

from tui.widgets.drawing import Key, fitting

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
    on,
)
from .block_actions import BLOCK_ACTIONS
from .monitor_actions import ORDER_ACTIONS, WATCH_ACTIONS
from .parameter_actions import PARAMETER_ACTIONS

of_app = partial(Action, app=True)
stops = partial(Action, app=True, first=True)
STOP = "Stop the motor on its ramp, wherever no text is being typed."
ABOVE_MONITOR = (PARAMETERS, BLOCKS, FAULTS, FRAMES, SOURCES)
NEVER_DROPPED = ("stop_by_space", "help")
"""Actions that stand in the line of keys however narrow the terminal is."""
WRITE_SOURCE = "Write the chosen configuration, armed and with the motor at rest."

ACTIONS: tuple[Action, ...] = (
    stops("stop_by_space", "space", "STOP", STOP),
    stops("stop", "f12", "", "Stop the motor on its ramp, from any screen, dialog or text."),
    stops("stop_all", "f9", "", "Stop every drive of the line on its ramp, from any screen."),
    *on(
        (CONNECTION,),
        ("open_chosen", "enter", "open", "Open the chosen line or drive."),
        ("scan", "s", "scan", "Look for drives at the addresses given."),
        ("type_line", "n", "type line", "Type a line: serial, TCP, RTU over TCP, sim."),
        ("refresh_lines", "r", "", "Look for serial ports again."),
        ("disconnect", "x", "close", "Close the line."),
        ("stop_scan", "escape", "", "Stop looking for drives."),
        ("watch_chosen", "2", "", "Go to Monitor of the chosen drive."),
    ),
    *on(
        (MONITOR, SOURCES, PARAMETERS, BLOCKS),
        ("arm", "a", "arm", "Arm this drive, or end that."),
    ),
    *ORDER_ACTIONS,
    Action("write_chosen", "enter", "write", WRITE_SOURCE, (SOURCES,), bound=False),
    *on(
        (FAULTS,),
        ("save", "s", "save", "Save the record of the trip to a file."),
        ("move_record(1)", "[", "older", "Older values."),
        ("move_record(-1)", "]", "newer", "Newer values."),
        ("leave", "escape,h,2", "back", "Go back to Monitor."),
    ),
    *on((SOURCES,), ("leave", "escape,c,2", "back", "Go back to Monitor.")),
    *on(ABOVE_MONITOR, ("go('leave')", "1", "", "Go to Connection.")),
    *on(
        tuple(screen for screen in ABOVE_MONITOR if screen != PARAMETERS),
        ("go('parameters')", "3", "", "Go to Parameters."),
    ),
    *on(
        tuple(screen for screen in ABOVE_MONITOR if screen != BLOCKS),
        ("go('blocks')", "4", "", "Go to Blocks."),
    ),
    *PARAMETER_ACTIONS,
    *BLOCK_ACTIONS,
    *WATCH_ACTIONS,
    *on(
        (FRAMES,),
        ("leave", "escape,l,2", "back", "Go back to Monitor."),
        ("hold", "h", "hold", "Hold the list still, or let it run."),
    ),
    of_app("command_palette", "ctrl+p", "all", "Find any action by its words."),
    of_app("help", "?,f1", "help", "Show every key."),
    of_app("redraw", "ctrl+l", "", "Draw the screen anew, should it be garbled."),
    of_app("quit", "q,ctrl+q", "leave", "Leave the panel."),
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
        if action.bound
        and action.app == (screen is None)
        and (screen is None or screen in action.screens)
    ]


def of_screen(screen: str) -> list[Action]:
    """Actions that work on a screen: the stop first, then the screen's own and the app's."""
    return [action for action in ACTIONS if screen in action.screens]


def line_of(screen: str, width: int) -> list[Key]:
    """The line of keys of a screen, the stop first; where it is narrow, without the last ones."""
    keys = [(action.id, action.shown, action.label) for action in of_screen(screen) if action.label]
    return fitting(keys, width, NEVER_DROPPED)


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
    "line_of",
    "of_screen",
]
