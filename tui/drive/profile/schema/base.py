"""Common parts of a profile's tables: kinds of numbers and texts."""

from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta, Struct

WordAddress = Annotated[int, Meta(ge=0, le=0xFFFF)]
RawWord = Annotated[int, Meta(ge=-0x8000, le=0xFFFF)]
CommandBits = Annotated[int, Meta(ge=-0x8000, le=0xFFFFFFFF)]
"""A command word of 16 or 32 bits; a negative one has 16."""
ReadCount = Annotated[int, Meta(ge=1, le=125)]
WriteCount = Annotated[int, Meta(ge=1, le=123)]
ExceptionByte = Annotated[int, Meta(ge=1, le=255)]
DeviceAddress = Annotated[int, Meta(ge=0, le=255)]
DecimalText = Annotated[str, Meta(pattern=r"^[0-9]+(\.[0-9]+)?$")]
SignedDecimalText = Annotated[str, Meta(pattern=r"^-?[0-9]+(\.[0-9]+)?$")]
Identifier = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_-]*$")]
BitNumber = Annotated[int, Meta(ge=0, le=15)]
LongBitNumber = Annotated[int, Meta(ge=0, le=31)]
LongWord = Annotated[int, Meta(ge=0, le=0xFFFFFFFF)]
"""The bits of one word or of two."""

Confidence = Literal[
    "site", "manual", "manual+public", "public-x2", "public", "analogy", "unverified"
]
"""Certainty of a fact, best first; below `public` it is shown as unverified. `site` is proved by
evidence of this site, and never in a file."""

Effective = Literal["at-once", "after-reset"]

Quantity = Literal[
    "command_word",
    "command_word_2",
    "extended_command_word",
    "status_word",
    "status_word_2",
    "status_word_3",
    "extended_status_word",
    "alarm_word",
    "life_alarm_word",
    "output_frequency",
    "frequency_reference",
    "ramp_output",
    "speed",
    "speed_reference",
    "motor_current",
    "motor_voltage",
    "mains_voltage",
    "dc_bus",
    "torque",
    "power",
    "input_power",
    "drive_thermal",
    "motor_thermal",
    "motor_load",
    "drive_load",
    "energy",
    "run_hours",
    "power_on_hours",
    "fault",
    "fault_history_1",
    "fault_history_2",
    "fault_history_3",
    "fault_history_4",
    "fault_history_5",
    "fault_history_6",
    "fault_history_7",
    "fault_history_8",
    "digital_inputs",
    "digital_outputs",
    "analogue_input_1",
    "analogue_input_2",
    "command_channel",
    "reference_channel",
    "command_frequency",
    "command_speed",
    "acceleration",
    "deceleration",
    "acceleration_2",
    "deceleration_2",
    "ramp_increment",
    "high_speed",
    "low_speed",
    "max_frequency",
    "rated_frequency",
    "rated_voltage",
    "rated_current",
    "rated_speed",
    "motor_poles",
    "drive_current",
    "thermal_current",
    "switching_frequency",
    "access_level",
    "control_profile",
    "save_settings",
    "line_address",
    "line_baud",
    "line_format",
    "line_timeout",
    "line_fault_reaction",
    "preset_speed_1",
    "preset_speed_2",
    "preset_speed_3",
    "preset_speed_4",
    "preset_speed_5",
    "preset_speed_6",
    "preset_speed_7",
    "stop_type",
    "drive_reference",
    "software_version",
]
"""Meaning of a parameter across families."""


def about(text: str) -> Meta:
    """Describe a field of a table, for readers and for the schema of the file."""
    return Meta(description=text)


class Table(Struct, frozen=True, forbid_unknown_fields=True):
    """One table of a profile: frozen, and an unknown key in it is an error."""


class When(Table, frozen=True, kw_only=True):
    """A condition on another parameter's raw value."""

    parameter: str
    mask: Annotated[LongWord | None, about("Bits of the word that are evaluated; absent: all.")] = (
        None
    )
    values: Annotated[
        list[int], about("Raw values of the parameter for which the condition holds.")
    ]

    def holds(self, raws: Mapping[str, int]) -> bool | None:
        """Return True if it holds, given raw values by code; None if its word is unknown."""
        raw = raws.get(self.parameter)
        if raw is None:
            return None
        return (raw if self.mask is None else raw & self.mask) in self.values
