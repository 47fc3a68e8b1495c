"""Defects of planned lines and of simulated drives: figures that no manual states."""

from __future__ import annotations

from .defect import Defect

CHECKS = "tui/session/line_plan/checks.py"
PLAN = "tests/session/test_line_plan.py"

DEFECTS = (
    Defect(
        "plan-counts-the-master",
        CHECKS,
        "if count > most:",
        "if count > most + 1:",
        "A plan with 32 slaves passes, and its line has too many receivers.",
        (PLAN,),
    ),
    Defect(
        "plan-without-station-resistors",
        CHECKS,
        "known = [ohm for ohm in map(plan.ohm, plan.elements) if ohm]",
        "known = [ohm for ohm in map(plan.ohm, plan.elements[:1]) if ohm]",
        "Stations of 4.7 kohm are not counted, and the polarization is too strong.",
        (PLAN,),
    ),
    Defect(
        "plan-terminator-anywhere",
        CHECKS,
        "                if fitted:\n",
        "                if not fitted:\n",
        "A terminator in the middle of the line passes.",
        (PLAN,),
    ),
    Defect(
        "plan-timeout-of-one-cycle",
        "tui/session/line_plan/timing.py",
        "longest = cycle + (RETRIES + 1) * (plant.master.timeout or reply)",
        "longest = cycle",
        "A suggested timeout trips drives as soon as one device does not answer.",
        (PLAN,),
    ),
    Defect(
        "guess-without-a-mark",
        "tui/simulator/about.py",
        "parameter.code in marks or parameter.quantity in marks",
        "parameter.code in marks",
        "Guessed thermal states of a simulated drive look like facts on Frames.",
        ("tests/simulator/test_about.py",),
    ),
)
