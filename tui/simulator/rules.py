"""Common and different behavior of the families, as tables: refusals, traits, first values.

Sources: ATV21 Modbus manual 7.10; ATV31, ATV312 and ATV71 Modbus manuals, exception
responses; PX-MODBUS manual 5.9 (no exception is documented: silence).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity

ChartKind = Literal["drivecom", "altivar21", "leroy-somer", "own"]

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
    """Differences of a family from related ones for which the profile has no field."""

    kind: ChartKind
    refusals: Refusals
    limits_follow: bool = False
    """True if a value beyond another parameter's limit is reduced to it instead of refused."""
    power_bit: bool = False
    """Status bit 4 shows that the power section is supplied (ATV71)."""
    enable_from_ready: bool = False
    """Enable operation is accepted in Ready to switch on too (ATV71 on a single supply)."""
    access_levels: bool = False
    """LAC below L3 lets an enable command start the drive without the chart (ATV31/312)."""
    config_disables: bool = False
    """Writing a stopped-only word takes Ready and Switched on back to disabled (ATV31/312)."""
    running_bit: bool = False
    """Extended status bit 4 shows that the motor runs (ATV31/312), not the speed mode."""
    remote_always: bool = False
    """Status bit 9 shows only that no forced local is on (ATV31/312)."""
    max_hz_high_resolution: float | None = None
    """Frequency of 32767 with CMI bit 9 set; None: the maximum frequency TFR (ATV71)."""
    ramps_to: Quantity = "rated_frequency"
    """Frequency that the ramps reach from 0 in the ramp time."""
    limits: Mapping[str, str] = field(default_factory=dict)
    """Words that the drive itself limits by another, in the same counts, by code."""
    first_values: Mapping[str, int] = field(default_factory=dict)
    """Settings of a simulated drive that was commissioned for the line, by code."""


_LINE_CONTROL = {
    "FR1": MODBUS_REFERENCE,
    "CD1": MODBUS_COMMAND,
    "CHCF": 1,
    "RFC": FIRST_CHANNEL,
    "TCT": 0,
}

_COMPACT = Traits(
    "drivecom",
    ALTIVAR,
    limits_follow=True,
    access_levels=True,
    config_disables=True,
    running_bit=True,
    remote_always=True,
    max_hz_high_resolution=600.0,
    first_values={**_LINE_CONTROL, "LAC": 2},
)
_LEROY_SOMER = Traits(
    "leroy-somer",
    SILENT,
    # 1.06 as in the example frame of the manual
    first_values={"1.06": 1500, "1.21": 900},
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
    "atv21": Traits(
        "altivar21",
        ALTIVAR_21,
        ramps_to="max_frequency",
        limits={"FA01": "FH"},
        first_values={"FH": 8000, "F111": 2, "F112": 6, "F113": 10, "F130": 4},
    ),
    "powerdrive": _LEROY_SOMER,
    "proxidrive": _LEROY_SOMER,
    "varmeca": _LEROY_SOMER,
}
_BY_KIND: Mapping[ChartKind, Traits] = {
    "drivecom": Traits("drivecom", ALTIVAR, limits_follow=True, first_values=_LINE_CONTROL),
    "altivar21": TRAITS["atv21"],
    "leroy-somer": TRAITS["powerdrive"],
    "own": Traits("own", Refusals(1, 2, 2, 3, 4, 3)),
}
PLAYED_BY: Mapping[ChartKind, tuple[str, ...]] = {
    "drivecom": (),
    "altivar21": ("FA00", "FD01"),
    "leroy-somer": ("6.42", "6.43", "10.40"),
}
"""Words that a drive must have to be simulated as one of a family; others follow their own
chart."""
LINE_WORDS = ("modbus", "line", "serial", "rs485", "rs-485")
"""Names of the line among the sources of a profile."""


def traits_of(profile: Profile) -> Traits:
    """Return the traits of a profile's family; those of a user's own profile follow its state
    chart."""
    if known := TRAITS.get(profile.id):
        return known
    kinds = {chart.kind for chart in profile.data.charts}
    codes = {parameter.code for parameter in profile.parameters}
    for kind, words in PLAYED_BY.items():
        if kind in kinds and codes.issuperset(words):
            return _BY_KIND[kind]
    return replace(_BY_KIND["own"], first_values=commissioned(profile))


def commissioned(profile: Profile) -> Mapping[str, int]:
    """Return the settings by code with which the line commands a drive, as far as its profile has
    them.

    They are the first configuration whose only command source is the line, and the values of
    writable words that the interlocks require.
    """
    values: dict[str, int] = {}
    for source in profile.data.control_sources:
        name = source.command.sources[0].casefold()
        if len(source.command.sources) == 1 and any(word in name for word in LINE_WORDS):
            values |= {setting.parameter: setting.value for setting in source.settings}
            break
    for lock in (lock for chart in profile.data.charts for lock in chart.interlocks):
        wanted = profile.find(lock.parameter)
        if wanted.access.startswith("rw") and wanted.code not in values and not lock.when:
            values[wanted.code] = lock.values[0]
    return values
