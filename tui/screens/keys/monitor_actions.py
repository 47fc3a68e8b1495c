"""Actions of the Monitor screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from tui.drive.reset_text import MAY_START

from .action import FAULTS, MONITOR, PARAMETERS, on

RUN = "Run forward: opens a line with the reference, Enter runs."
REVERSE = "Run reverse: opens a line with the reference, Enter runs."
REFER = "Give a reference in Hz or rpm: opens a line, Enter gives it."
OPTIONS = "Choose a ramp, preset speed, motor or output; armed, asks."
QUICK = "Quick stop at once, where the drive has one, else its ramp stop; needs no arming."
EMERGENCY = "Emergency stop at once, else the quick stop, else the ramp stop; needs no arming."
COAST = "Coast to a stop; asks first, needs no arming. A hoist load falls."
BRAKE = "Brake by direct current, where the drive has that; asks, needs no arming."
TAKE = "Take the control from the terminals, where a drive has that; armed, locked only, asks."
HAND_BACK = "Return control to the terminals. A run command active there counts; asks."
TEACH = "Teach the scale of a raw value by the drive's own display."
GIVE_BY = "Give the reference by a taught preset, or no more; asks."
TAKE_OVER = "Look after a motor that an earlier program started; sends nothing, armed only."

RESET_HELP = f"Reset the fault. Needs arming; asks first. {MAY_START}"
INPUTS = "Set inputs of a simulated drive: LI1=1, AI1=5V."

COMMAND_ACTIONS = (
    *on(
        (MONITOR,),
        ("run_line('forward')", "r", "run", RUN),
        ("run_line('reverse')", "v", "reverse", REVERSE),
        ("run_line('reference')", "f", "ref", REFER),
    ),
    *on((MONITOR, FAULTS), ("reset", "x", "reset", RESET_HELP)),
    *on(
        (MONITOR,),
        (
            "step_reference(1)",
            "up",
            "",
            "Raise the reference by 1 Hz, at most to its limit; armed.",
        ),
        (
            "step_reference(-1)",
            "down",
            "",
            "Lower the reference by 1 Hz, at most to its limit; armed.",
        ),
        ("step_reference(5)", "pageup", "", "Raise the reference by 5 Hz; armed."),
        ("step_reference(-5)", "pagedown", "", "Lower the reference by 5 Hz; armed."),
        ("options", "o", "", OPTIONS),
        ("stop_as('quick-stop')", "k", "", QUICK),
        ("stop_as('emergency-stop')", "e", "", EMERGENCY),
        ("ask_stop_as('freewheel')", "z", "", COAST),
        ("ask_stop_as('dc-braking')", "b", "", BRAKE),
        ("take_control", "t", "", TAKE),
        ("hand_back", "g", "", HAND_BACK),
        ("take_over", "T", "", TAKE_OVER),
        ("inputs", "l", "", INPUTS),
    ),
)
TEACH_ACTIONS = (
    *on((MONITOR, PARAMETERS), ("teach", "L", "", TEACH)),
    *on((MONITOR,), ("reference_by", "R", "", GIVE_BY)),
)
WATCH_ACTIONS = on(
    (MONITOR,),
    ("next_word", "tab", "", "Show the next word with all its bits."),
    ("trend_window(-1)", "<", "", "A shorter window of the trend: 10 s, 60 s, 10 min."),
    ("trend_window(1)", ">", "", "A longer window of the trend."),
    ("leave", "escape", "", "Go back to Line."),
    ("change_rate(1)", "", "", "Poll twice as fast."),
    ("change_rate(-1)", "", "", "Poll half as fast."),
    ("rating", "", "", "Enter the rated current of a drive that gives its current in %."),
)
