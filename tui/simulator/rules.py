"""What the families do alike and differently, as tables: refusals, traits, first values.

Sources: ATV21 Modbus manual 7.10; ATV31, ATV312 and ATV71 Modbus manuals, exception
responses; PX-MODBUS manual 5.9 (no exception is documented: silence).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from tui.drive.profile.profile import Profile

ChartKind = Literal["drivecom", "altivar21", "leroy-somer"]

MODBUS_REFERENCE = 164
FIRST_CHANNEL = 96
MODBUS_COMMAND = 10


@dataclass(frozen=True, slots=True)
class Refusals:
    """Exception code for each way a request can be refused; None: the drive stays silent."""

    unknown_function: int | None
    unknown_address: int | None
    read_only: int | None
    out_of_range: int | None
    not_now: int | None
    wrong_shape: int | None


ALTIVAR_21 = Refusals(1, 2, 2, 3, 4, 3)
ALTIVAR = Refusals(1, 2, 4, 3, 4, 3)
SILENT = Refusals(None, None, None, None, None, None)


@dataclass(frozen=True, slots=True)
class Traits:
    """How a family differs from its sisters where the profile has no field for it."""

    kind: ChartKind
    refusals: Refusals
    limits_follow: bool = False
    """True where a value past another parameter's limit is cut to it instead of refused."""
    power_bit: bool = False
    """Status bit 4 tells that the power section is supplied (ATV71)."""
    enable_from_ready: bool = False
    """Enable operation is taken in Ready to switch on too (ATV71 on a single supply)."""
    access_levels: bool = False
    """LAC below L3 lets an enable command start the drive without the chart (ATV31/312)."""
    config_disables: bool = False
    """Writing a stopped-only word takes Ready and Switched on back to disabled (ATV31/312)."""
    running_bit: bool = False
    """Extended status bit 4 tells that the motor runs (ATV31/312), not the speed mode."""
    history_before: bool = False
    """The fault history begins with the fault before the last one (ATV31/312)."""
    remote_always: bool = False
    """Status bit 9 tells only that no forced local is on (ATV31/312)."""
    max_hz_high_resolution: float | None = None
    """Frequency of 32767 with CMI bit 9 set; None: the maximum frequency TFR (ATV71)."""
    first_values: Mapping[str, int] = field(default_factory=dict)
    """Settings of a simulated drive that was commissioned for the line, by code."""


_LINE_CONTROL = {"FR1": MODBUS_REFERENCE, "CD1": MODBUS_COMMAND, "CHCF": 1, "RFC": FIRST_CHANNEL}

_COMPACT = Traits(
    "drivecom",
    ALTIVAR,
    limits_follow=True,
    access_levels=True,
    config_disables=True,
    running_bit=True,
    history_before=True,
    remote_always=True,
    max_hz_high_resolution=600.0,
    first_values={**_LINE_CONTROL, "LAC": 2},
)
TRAITS: Mapping[str, Traits] = {
    "atv71": Traits(
        "drivecom",
        ALTIVAR,
        limits_follow=True,
        power_bit=True,
        enable_from_ready=True,
        first_values=_LINE_CONTROL,
    ),
    "atv31": _COMPACT,
    "atv312": _COMPACT,
    "atv21": Traits("altivar21", ALTIVAR_21),
    "powerdrive": Traits("leroy-somer", SILENT),
    "proxidrive": Traits("leroy-somer", SILENT),
    "varmeca": Traits("leroy-somer", SILENT),
}
_BY_KIND: Mapping[ChartKind, Traits] = {
    "drivecom": Traits("drivecom", ALTIVAR, limits_follow=True, first_values=_LINE_CONTROL),
    "altivar21": TRAITS["atv21"],
    "leroy-somer": TRAITS["powerdrive"],
}


def traits_of(profile: Profile) -> Traits:
    """The traits of a profile's family; a user's own profile goes by its state chart."""
    if known := TRAITS.get(profile.id):
        return known
    kinds = {chart.kind for chart in profile.data.charts}
    for kind in ("altivar21", "leroy-somer"):
        if kind in kinds:
            return _BY_KIND[kind]
    return _BY_KIND["drivecom"]
