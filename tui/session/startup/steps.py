"""Steps of a guided start-up, as a file has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, NamedTuple

from msgspec import Meta

from tui.drive.profile.schema import Table
from tui.drive.profile.schema.base import Confidence, RawWord

StepKind = Literal[
    "record",
    "identity",
    "settings",
    "direction",
    "stops",
    "loss",
    "speeds",
    "save",
    "backup",
    "report",
]
MOST_GUIDE_STEPS = 60
FilledText = Annotated[str, Meta(min_length=1)]
GuideHertz = Annotated[float, Meta(ge=0.1, le=1000)]


class KindAccess(NamedTuple):
    """Access of a kind of step to the drive, besides the parameters that the step names."""

    reads: str
    writes: str
    """Each of these is written on another screen, armed and confirmed there."""


KIND_ACCESS: Mapping[StepKind, KindAccess] = {
    "record": KindAccess("nothing", "nothing"),
    "identity": KindAccess("the drive's identity", "nothing"),
    "settings": KindAccess("", "what you stage"),
    "direction": KindAccess("frequency, current", "run, reference and stop on Monitor"),
    "stops": KindAccess("frequency", "run, reference and stops on Monitor"),
    "loss": KindAccess("state, timeout", "nothing: polling pauses"),
    "speeds": KindAccess("frequency, current", "run, reference and stop on Monitor"),
    "save": KindAccess("state", "the command that saves to EEPROM"),
    "backup": KindAccess("every setting", "nothing"),
    "report": KindAccess("every parameter", "nothing"),
}


class GuideField(Table, frozen=True, kw_only=True):
    """One thing that a person records."""

    name: FilledText
    kind: Literal["text", "number", "tick"] = "text"
    unit: str = ""
    optional: bool = False
    """A tick that is not optional must be set."""
    least: str = ""
    """Name of the field with the lowest allowed number; if that is empty, nothing is judged."""


class GuideStep(Table, frozen=True, kw_only=True):
    """One step of a start-up, in the order of the file."""

    step: FilledText
    """Short name; unique in the file, as results are kept by it."""
    kind: StepKind
    from_profile: str = ""
    """Name of a step of the profile's `[[start_up]]`, for what this step does not give itself."""
    text: str = ""
    note: str = ""
    source: str = ""
    """Manual and page of the step."""
    confidence: Literal[Confidence, "practice", ""] = ""
    parameters: list[str] = []
    """Codes that are set or checked."""
    plate: list[str] = []
    """Codes of numbers that the person types from a nameplate; the drive's must be equal."""
    expect: dict[str, list[RawWord]] = {}
    """Raw values, by code, with which the step is done."""
    fields: list[GuideField] = []
    hz: list[GuideHertz] = []
    """Reference of a direction check, or those of a run at several speeds."""
    rated: str = ""
    """Code of the motor's rated current, shown beside the measured current."""
    reverse: str = ""
    """Code of the parameter that changes the direction of rotation."""
    remedy: str = ""
    """Work for the person if the direction is wrong."""
    methods: list[str] = []
    """Stop commands that are tested."""

    @property
    def codes(self) -> list[str]:
        """Codes of all parameters that the step shows."""
        extra = (*self.expect, self.rated, self.reverse)
        found = (*self.plate, *self.parameters, *extra)
        return list(dict.fromkeys(code for code in found if code))


class GuideHead(Table, frozen=True, kw_only=True):
    """Head of a file."""

    profile: FilledText
    """Id of the family."""
    title: str = ""


class GuideTables(Table, frozen=True, kw_only=True):
    """A file of steps."""

    startup: GuideHead
    steps: Annotated[list[GuideStep], Meta(min_length=1, max_length=MOST_GUIDE_STEPS)]
