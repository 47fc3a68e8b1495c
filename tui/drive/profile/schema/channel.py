"""Words that show the active command and reference channels."""

from typing import Annotated

from msgspec import Meta

from .base import Confidence, Table, When, WordAddress, about


class ChannelRow(Table, frozen=True, kw_only=True):
    """A word that shows the active channel, if its conditions hold."""

    parameter: str
    when: Annotated[list[When], about("Conditions for the row; all must hold.")] = []
    mask: Annotated[WordAddress, about("Bits that show the channel, before the shift.")] = 0xFFFF
    shift: Annotated[int, Meta(ge=0, le=15)] = 0
    line: Annotated[list[int], about("Values, after mask and shift, that mean this line.")] = []
    names: Annotated[
        dict[str, str],
        about("Names of the values; empty: names of the parameter or its bits."),
    ] = {}


class ChannelSwitch(Table, frozen=True, kw_only=True):
    """A parameter that can switch channels while the drive runs."""

    parameter: str
    fixed: Annotated[list[int], about("Raw values for which nothing is switched.")]
    when: Annotated[list[When], about("Conditions for switching; all must hold.")] = []
    does: Annotated[
        str,
        about("Further effect; a clause that follows the parameter's name and value."),
    ]


class Channels(Table, frozen=True, kw_only=True):
    """Command and reference channels; the first row that applies is used."""

    command: Annotated[list[ChannelRow], about("Words that show the command channel.")] = []
    reference: Annotated[list[ChannelRow], about("Words that show the reference channel.")] = []
    switches: Annotated[list[ChannelSwitch], about("Parameters that can switch channels.")] = []
    remedy: Annotated[str, about("Setting that gives command to Modbus, as a sentence.")] = ""
    source: str = ""
    confidence: Confidence = "manual"
