"""Registration of Monitor, and of the screen shown until its drive is known."""

from __future__ import annotations

from ..keys.action import ARMING, RESET_FAULT, TEACH, Registration, key_rows

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
GIVE_BY = "Set the reference by a learned preset, or end that. Asks first."
TAKE_OVER = "Take over a motor whose program has ended; sends nothing. Needs arming."
REHEARSE = "Rehearse on a simulated drive: trip, power, wire, mains, load, inertia, jam, key."
INPUTS = "Set inputs of a simulated drive: LI1=1, AI1=5V."

COMMAND_ACTIONS = (
    *key_rows(
        ("run_line('forward')", "r", "run", RUN),
        ("run_line('reverse')", "v", "reverse", REVERSE),
        ("run_line('reference')", "f", "ref", REFER),
    ),
    RESET_FAULT,
    *key_rows(
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
"""Actions that command the drive."""


REGISTERED = (
    Registration(
        title="Monitor",
        about="the state of the motor; commands",
        digit="2",
        narrow="Mon",
        actions=(
            *ARMING,
            *COMMAND_ACTIONS,
            TEACH,
            *key_rows(
                ("reference_by", "R", "", GIVE_BY),
                ("next_word", "tab", "", "Show all values, then each word with all its bits."),
                (
                    "trend_window(-1)",
                    "<",
                    "",
                    "Shorten the time of the curve, down to 10 s.",
                ),
                (
                    "trend_window(1)",
                    ">",
                    "",
                    "Lengthen the time of the curve, up to 10 min.",
                ),
                ("cursor", "=", "", "Read the curve at a point in time, or close that cursor."),
                (
                    "move_cursor(-1)",
                    "left",
                    "",
                    "Move the cursor back in time. = opens it.",
                ),
                ("move_cursor(1)", "right", "", "Move the cursor forward in time."),
                ("leave", "escape", "", "Close the cursor; else go back to Line."),
                ("rehearse", "", "", REHEARSE),
                ("change_rate(1)", "", "", "Poll twice as often."),
                ("change_rate(-1)", "", "", "Poll half as often."),
                ("rating", "", "", "Enter the rated current, if the drive gives its current in %."),
            ),
        ),
    ),
    Registration(
        title="Opening",
        actions=key_rows(("leave", "escape", "Line", "Cancel the opening, or go to Line.")),
    ),
)
