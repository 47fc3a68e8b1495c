"""Sources of the simulated behavior: a manual, another public document, or a guess.

Only behavior in which a drive could differ is listed. Registers, ranges, faults and scales are
those of the profile, which has the source of each.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

from tui.drive.profile.profile import Profile

from .rules import ChartKind, traits_of

Provenance = Literal["printed", "public", "guess"]
"""`printed` in the manual of the family, known from another `public` document, or a `guess`."""


class Behavior(NamedTuple):
    """One behavior of a simulated drive, and where it is from."""

    text: str
    provenance: Provenance
    source: str
    """Manual and chapter, public document, or the reason for the guess."""
    families: tuple[str, ...] = ()
    """Ids of the profiles that behave so; all of the kind without any."""
    shows_in: tuple[str, ...] = ()
    """Codes, or quantities, of the values that it decides."""


EVERY: tuple[Behavior, ...] = (
    Behavior(
        "Registers, ranges, access, storage, faults and scales are those of the profile.",
        "printed",
        "the profile: `drivepanel profiles` shows the source of each",
    ),
    Behavior(
        "Ramps are straight, slip is in proportion to torque, and two time constants give the"
        " thermal states.",
        "guess",
        "a plausible motor, not that of a model",
        shows_in=("motor_thermal", "drive_thermal"),
    ),
    Behavior(
        "The load has 35 % of its torque at standstill, and grows with the square of the speed.",
        "guess",
        "like a fan with friction",
        shows_in=("motor_current", "torque", "motor_load", "drive_load", "power"),
    ),
    Behavior(
        "Below 70 % of the rated supply, the drive trips on undervoltage.",
        "guess",
        "no manual here gives the level",
    ),
    Behavior(
        "With a larger inertia, a DC bus above 120 % of its rated voltage trips the drive.",
        "guess",
        "no manual here gives the level",
    ),
    Behavior(
        "A motor that is overloaded or jammed trips at a thermal state of 118 %.",
        "guess",
        "the range of THR of the Altivar 71, used for all families",
    ),
    Behavior(
        "A jammed motor takes 160 % of its rated torque at the frequency of that slip.",
        "guess",
        "a current limitation of usual size",
    ),
)
"""Behavior of all drives."""

_DRIVECOM = "States, the command word and the channels are those of the Drivecom profile."
_LINE_71 = "ATV71 Modbus manual; communication parameters guide"
_LINE_312 = "ATV312 Modbus manual; communication variables"
BY_CHART: Mapping[ChartKind, tuple[Behavior, ...]] = {
    "altivar21": (
        Behavior(
            "Settings of the port and of the blocks (F800, F801, F829, F870 to F879) take effect at"
            " a power cycle or a reset.",
            "printed",
            "ATV21 Modbus manual 6, 6.1, 6.3",
        ),
        Behavior(
            "A reset at standstill counts as one even without a fault.",
            "guess",
            "chapter 6 only says: reset",
        ),
        Behavior(
            "Command and reference words return to their first values at power-down and at a fault"
            " reset.",
            "printed",
            "ATV21 Modbus manual 8.2",
        ),
        Behavior(
            "Bits 14 and 15 of FA00 take reference and command; stop and reset need bit 15, the"
            " emergency stop does not.",
            "printed",
            "ATV21 Modbus manual 8.4",
        ),
        Behavior(
            "ACC and DEC are the times between 0 and FH.",
            "public",
            "sister families, as the notes on ACC and FH in the profile",
        ),
        Behavior(
            "Bits 1 to 7 of FA50 are accepted and read back as written, without effect. Above 255"
            " the write is refused.",
            "guess",
            "8.8 prints bits 1 to 15 as reserved, 8.2 a range of 0 to 255",
            shows_in=("FA50",),
        ),
        Behavior(
            "The LOC/REM key always works; FD01 bit 15, FE45 and FE46 show local.",
            "printed",
            "ATV21 Modbus manual 6.2, 8.6",
        ),
        Behavior(
            "LOC keeps the motor as it runs. STOP pressed twice in remote trips E.",
            "guess",
            "general knowledge of sister families (F295, F735)",
        ),
        Behavior(
            "The timeout F803 starts with the first valid request; F603 sets the stop.",
            "printed",
            "ATV21 Modbus manual 6.4",
        ),
        Behavior(
            "Refusals have the exceptions of the table.",
            "printed",
            "ATV21 Modbus manual 7.10",
        ),
        Behavior(
            "The energy counters FE76 and FE77 count kWh. FE20 and FE21 refer to the rated"
            " current.",
            "guess",
            "8.3 prints no unit and no base",
            shows_in=("FE76", "FE77", "FE20", "FE21"),
        ),
    ),
    "drivecom": (
        Behavior(
            _DRIVECOM,
            "printed",
            _LINE_71,
            ("atv71",),
        ),
        Behavior(
            _DRIVECOM,
            "printed",
            _LINE_312,
            ("atv31", "atv312"),
        ),
        Behavior(
            "The timeout starts once a command or a reference was written.",
            "printed",
            "ATV71 Modbus manual, communication fault management",
            ("atv71",),
        ),
        Behavior(
            "The timeout starts with the first request.",
            "guess",
            "no document says when it starts",
            ("atv31", "atv312"),
            shows_in=("ttO",),
        ),
        Behavior(
            "The timeout ttO is accepted up to 30 s.",
            "printed",
            "ATV312 Modbus manual; the list of variables says 10 s",
            ("atv312",),
        ),
        Behavior(
            "With PSt, the STOP key lets the motor coast.",
            "guess",
            "general knowledge of the programming manuals",
        ),
        Behavior(
            "After the STOP key, a closed run input must open first.",
            "guess",
            "no document here describes it",
        ),
        Behavior(
            "A closed run input starts the motor again after a reset, unless TCT requires an edge.",
            "printed",
            "communication variables, TCC and TCT",
        ),
        Behavior(
            "An analog input gives a reference from LSP at 0 to HSP at its full scale.",
            "guess",
            "general knowledge of the programming manuals",
        ),
    ),
    "leroy-somer": (
        Behavior(
            "6.42 commands while 6.43 is 1, and the terminals do not.",
            "printed",
            "PX-MODBUS manual 5.5",
        ),
        Behavior(
            "The reference stays that of the terminals. Bit 8 chooses the preset 1.21, in rpm of 4"
            " poles.",
            "guess",
            "5.5 names no reference register",
            shows_in=("1.21",),
        ),
        Behavior(
            "A wrong request is not answered.",
            "guess",
            "5.9 prints no exceptions",
        ),
        Behavior(
            "15.04 is a code: 0 is 300 baud, 9 is 115200. A change takes effect immediately.",
            "guess",
            "the PX-MODBUS manual 4 prints the codes, but not when a change takes effect",
            shows_in=("15.04", "11.25"),
        ),
        Behavior(
            "15.07 counts 0.1 s: raw 250 is 25.0 s, 0 is off.",
            "guess",
            "the PX-MODBUS manual 4 prints 0.0 to 25.0 s, but not the scale",
            shows_in=("15.07", "11.63"),
        ),
        Behavior(
            "The timeout starts with the first request, and the motor coasts.",
            "guess",
            "the PX-MODBUS manual 4 does not say when it starts",
        ),
    ),
    "own": (
        Behavior(
            "States, commands and transitions are those of the profile; ramps and terminals are"
            " simple ones.",
            "guess",
            "the profile describes no more",
        ),
        Behavior(
            "The keys of the keypad are not simulated.",
            "guess",
            "the profile describes no keypad",
        ),
    ),
}
"""Behavior by kind of chart."""


def behaviors_of(profile: Profile) -> list[Behavior]:
    """Return the behavior of a simulated drive, that of its family first."""
    own = BY_CHART[traits_of(profile).kind]
    return [item for item in own if not item.families or profile.id in item.families] + [*EVERY]


def guessed_codes(profile: Profile) -> frozenset[str]:
    """Return the codes of the values that a simulated drive of this family makes by a guess."""
    marks = {
        m for item in behaviors_of(profile) if item.provenance == "guess" for m in item.shows_in
    }
    return frozenset(
        parameter.code
        for parameter in profile.parameters
        if parameter.code in marks or parameter.quantity in marks
    )
