"""Actions of the Monitor screen: action, keys, label in the line of keys, help."""

from __future__ import annotations

from .action import MONITOR, on

HAND_BACK = "Give the control back to the terminals; a run order waiting there counts then."
EMERGENCY = "Emergency stop with a fault (Altivar 21); needs no arming."
BRAKE = "Brake by direct current, where the drive has an order for it."
TAKE_OVER = "Look after a motor that an earlier program started; sends nothing, armed only."
TAKE = "Take the control from the terminals (Leroy-Somer 6.43), locked only."

ORDER_ACTIONS = on(
    (MONITOR,),
    ("order('forward')", "r", "run", "Run forward."),
    ("order('reverse')", "v", "reverse", "Run reverse."),
    ("reference", "f", "ref", "Type a reference in Hz or rpm."),
    ("order('reset')", "x", "reset", "Reset a fault; runs nothing."),
    ("step_reference(1)", "up", "", "Raise the reference by 1 Hz."),
    ("step_reference(-1)", "down", "", "Lower the reference by 1 Hz."),
    ("step_reference(5)", "pageup", "", "Raise the reference by 5 Hz."),
    ("step_reference(-5)", "pagedown", "", "Lower the reference by 5 Hz."),
    ("options", "o", "", "Choose a ramp, preset speed, motor or output."),
    ("stop_as('quick-stop')", "k", "", "Quick stop, where the drive has one; needs no arming."),
    ("stop_as('freewheel')", "z", "", "Let the motor coast; needs no arming."),
    ("stop_as('emergency-stop')", "e", "", EMERGENCY),
    ("order('dc-braking')", "b", "", BRAKE),
    ("order('take-control')", "t", "", TAKE),
    ("hand_back", "g", "", HAND_BACK),
    ("take_over", "T", "", TAKE_OVER),
    ("control_source", "c", "", "See and set up who commands the drive."),
)
WATCH_ACTIONS = on(
    (MONITOR,),
    ("faults", "h", "", "Faults: the last trip, the drive's history and what it stored."),
    ("parameters", "3", "", "Parameters of this drive."),
    ("blocks", "4", "", "Indirect blocks or scanner."),
    ("leave", "escape,1", "", "Go back to Connection."),
    ("step_drive(-1)", "[", "", "The drive before on this line."),
    ("step_drive(1)", "]", "", "The next drive on this line."),
    ("change_rate(1)", "+,=", "", "Poll twice as fast."),
    ("change_rate(-1)", "-", "", "Poll half as fast."),
    ("next_word", "w", "", "Show the next word of bits."),
    ("rating", "i", "", "Tell the rated current of a drive that gives its current in %."),
    ("frames", "l", "", "Show the frames on the line."),
)
