"""The form of a help file: help on the faults and alarms of a family."""

from typing import Annotated, Literal

from msgspec import Meta

from .base import LongBitNumber, RawWord, SignedDecimalText, Table, When, WordAddress, about
from .parameter import Multiple

HelpConfidence = Literal["manual", "public", "practice"]
"""Certainty of the first cause; `practice` is general practice, from no document."""

ResetWay = Literal["by-reset", "automatic", "by-itself", "power-cycle"]
"""End of a fault once its cause is gone: by a reset, by the drive's automatic restart too if
that is on, without action, or only by switching the drive off and on."""


class LookAt(Table, frozen=True, kw_only=True):
    """A parameter to check after a fault, and why."""

    code: str
    why: Annotated[str, about("Information that it gives on this fault.")]


class CauseRule(Table, frozen=True, kw_only=True):
    """Values of a parameter that rule out a cause or a check, or support a cause.

    All given conditions must hold; at least one is needed.
    """

    text: Annotated[str, about("The cause or check, word for word as in `probable` or `check`.")]
    parameter: Annotated[
        str,
        about(
            "The live parameter: the value that the drive stored from it at the trip is used first."
        ),
    ]
    mask: Annotated[
        WordAddress | None,
        about("Bits of the word that `values` refers to; absent: all."),
    ] = None
    values: Annotated[list[int], about("Raw values for which the rule holds.")] = []
    min: Annotated[int | None, about("With `max`: the lowest raw value for which it holds.")] = None
    max: Annotated[int | None, about("With `min`: the highest raw value for which it holds.")] = (
        None
    )
    at_least: Annotated[
        SignedDecimalText | None,
        about("Lowest value for which it holds, in the parameter's unit."),
    ] = None
    at_most: Annotated[
        SignedDecimalText | None,
        about("Highest value for which it holds, in the parameter's unit."),
    ] = None
    at_least_of: Annotated[
        Multiple | None,
        about(
            "Lowest value for which it holds, as a multiple of another parameter of the same unit."
        ),
    ] = None
    at_most_of: Annotated[
        Multiple | None,
        about(
            "Highest value for which it holds, as a multiple of another parameter of the same unit."
        ),
    ] = None
    when: Annotated[list[When], about("Conditions; their words must be known.")] = []
    at: Annotated[
        Literal["trip", "now"] | None,
        about(
            "Time of the value: `trip` for a motor current, which is 0 after it; `now` "
            "for a motor that must cool. Absent: the value at the trip, or the present "
            "one if that is not known."
        ),
    ] = None
    weight: Annotated[
        int,
        Meta(ge=1, le=3),
        about("Strength of the support: 1 for a hint, 3 if it explains the fault alone."),
    ] = 1
    source: str = ""
    confidence: HelpConfidence = "practice"

    @property
    def has_condition(self) -> bool:
        """True if it can hold at all."""
        raw = bool(self.values) or (self.min is not None and self.max is not None)
        return raw or any(limit is not None for limit in (self.at_least, self.at_most, *self.of))

    @property
    def of(self) -> tuple[Multiple | None, Multiple | None]:
        """Its limits that follow other parameters, the lower one first."""
        return self.at_least_of, self.at_most_of

    @property
    def codes(self) -> tuple[str, ...]:
        """Codes of the parameters that it needs, its own first."""
        limits = (limit.parameter for limit in self.of if limit is not None)
        return (self.parameter, *limits, *(when.parameter for when in self.when))


class Hint(Table, frozen=True, kw_only=True):
    """Help on a fault or alarm: causes, checks, parameters."""

    probable: Annotated[
        list[str],
        Meta(min_length=1),
        about("Probable causes, the likeliest first."),
    ]
    check: Annotated[list[str], about("Checks, one per entry.")] = []
    look_at: Annotated[list[LookAt], about("Parameters to check, and why.")] = []
    ruled_out: Annotated[
        list[CauseRule], about("Causes and checks that a value can rule out.")
    ] = []
    supported: Annotated[
        list[CauseRule],
        about("Causes that a value can support; they are shown before those without support."),
    ] = []
    source: str = ""
    confidence: HelpConfidence = "practice"


class FaultHelp(Hint, frozen=True, kw_only=True):
    """Help on a fault."""

    raw: Annotated[
        RawWord | None,
        about(
            "The fault, as among the profile's codes; absent: any trip of a family without numbers."
        ),
    ] = None
    code: Annotated[
        str, about("Code of the fault, for readers of the file; must match the profile.")
    ] = ""
    name: Annotated[str, about("Name of the fault if `raw` is absent.")] = ""
    reset: Annotated[
        ResetWay | None,
        about(
            "End of the fault; absent if no document states it. Recalled from memory, "
            "so the drive's own sign takes precedence."
        ),
    ] = None
    wait_s: Annotated[
        Annotated[int, Meta(ge=1)] | None,
        about("Approximate seconds to wait before a reset can work."),
    ] = None


class AlarmHelp(Hint, frozen=True, kw_only=True):
    """Help on an alarm bit."""

    word: Annotated[str, about("The parameter that carries the bit.")]
    bit: LongBitNumber
    name: str = ""


class HelpData(Table, frozen=True, kw_only=True):
    """A whole help file."""

    faults: Annotated[list[FaultHelp], about("Help on each fault.")] = []
    alarms: Annotated[list[AlarmHelp], about("Help on each alarm bit.")] = []
