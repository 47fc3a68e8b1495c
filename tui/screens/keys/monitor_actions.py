"""Actions of the Monitor screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from tui.drive.reset_text import MAY_START

from .action import FAULTS, MONITOR, PARAMETERS, on

RUN = "Run forward. Opens the run line; Enter runs. Needs arming."
REVERSE = "Run reverse. Opens the run line; Enter runs. Needs arming."
REFER = "Set the reference in the run line. Needs arming."
OPTIONS = "Choose a ramp, speed, motor or output. Needs arming; asks first."
QUICK = "Quick stop immediately; ramp stop if the drive has none. Needs no arming."
EMERGENCY = "Emergency stop immediately; else quick stop, else ramp stop. Needs no arming."
COAST = "Coast to a stop; a hoist load falls. Needs no arming; asks first."
BRAKE = "DC brake, if the drive has it. Needs no arming; asks first."
TAKE = "Take control from the terminals, if the drive can. Needs arming and lock; asks first."
HAND_BACK = (
    "Return control to the terminals. Needs arming; asks first."
    " A run command active there starts the motor."
)
TEACH = "Learn the scale of a raw value from the drive's display."
GIVE_BY = "Set the reference by a preset with a learned scale, or end that. Asks first."
TAKE_OVER = "Take over a motor whose program has ended; sends nothing. Needs arming."

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
            "Raise the reference by 1 Hz, up to its limit. Needs arming.",
        ),
        (
            "step_reference(-1)",
            "down",
            "",
            "Lower the reference by 1 Hz, down to its limit. Needs arming.",
        ),
        ("step_reference(5)", "pageup", "", "Raise the reference by 5 Hz. Needs arming."),
        ("step_reference(-5)", "pagedown", "", "Lower the reference by 5 Hz. Needs arming."),
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
    ("next_word", "tab", "", "Show the next status word with all its bits."),
    ("trend_window(-1)", "<", "", "Shorten the time window of the trend: 10 min, 60 s, 10 s."),
    ("trend_window(1)", ">", "", "Lengthen the time window of the trend."),
    ("leave", "escape", "", "Go back to Line."),
    ("change_rate(1)", "", "", "Poll twice as often."),
    ("change_rate(-1)", "", "", "Poll half as often."),
    ("rating", "", "", "Enter the rated current, if the drive gives its current in %."),
)
