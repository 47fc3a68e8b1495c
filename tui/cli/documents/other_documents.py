"""Documents about ports, profiles and simulated lines."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from .document import Document, DocumentPart
from .parts import LastMinuteField


class PortDocument(Document, kw_only=True):
    """`ports`: one port of the list."""

    command: Literal["ports"] = "ports"
    path: str
    description: str
    holder: str | None
    lasting: Annotated[
        str | None,
        Meta(description="Permanent link of this adapter or its socket; null if there is none."),
    ]
    adapter: Annotated[
        str | None,
        Meta(
            description="USB vendor, product and serial number; null for a port that is not on USB."
        ),
    ]


class NamedLineField(DocumentPart):
    """A line that the settings file names."""

    name: str
    line: str
    device: int | None
    profile: str | None


class KnownDriveField(DocumentPart):
    """A drive that answered at an address when its line was used last."""

    device: int
    vendor: str | None
    reference: str | None
    version: str | None
    name: str | None
    profile: str | None


class KnownLineField(DocumentPart):
    """Stored facts of a line."""

    line: str
    adapter: str | None
    drives: list[KnownDriveField]


class LeftOnLineDocument(DocumentPart):
    """A motor whose program has exited, with its place."""

    line: str
    device: int
    program: str
    pid: int
    exited: bool
    left_running: bool
    since: str
    text: str


class LineClientDocument(DocumentPart):
    """A program on a line that is open."""

    program: str
    pid: int
    share: Annotated[
        float, Meta(description="Of the line's time, over about 10 s: 1 is all of it.")
    ]


class OpenLineDocument(DocumentPart):
    """A line that is open, and the process that holds it: `keeper` as a rule."""

    line: str
    program: str
    pid: int
    clients: Annotated[
        list[LineClientDocument] | None,
        Meta(description="The programs on the line; null without an answer of its holder."),
    ]
    last_minute: Annotated[
        LastMinuteField | None,
        Meta(
            description="Its health; null without an answer, or from a holder of an older version."
        ),
    ]


class LinesDocument(Document, kw_only=True):
    """`lines`: named lines, errors of the settings file, and remembered lines."""

    command: Literal["lines"] = "lines"
    settings: str
    faults: list[str]
    lines: list[NamedLineField]
    known: list[KnownLineField]
    open: list[OpenLineDocument]
    left_behind: list[LeftOnLineDocument]


class ProfileDocument(Document, kw_only=True):
    """`profiles`: one of the list."""

    command: Literal["profiles"] = "profiles"
    id: str
    name: str
    vendor: str
    parameters: int
    own: bool
    file: str
    remark: str


class ProfileShown(Document, kw_only=True):
    """`profiles ID`: the profile itself, as profiles/profile.schema.json describes it."""

    command: Literal["profiles"] = "profiles"
    profile: dict[str, Any]
    sources: list[Any]
    errata: list[Any]
    identification: dict[str, Any]
    link: dict[str, Any]
    addresses: dict[str, Any]
    functions: list[Any]
    port_counters: list[Any]
    reading: dict[str, Any]
    blocks: list[Any]
    exceptions: list[Any]
    frames: list[Any]
    charts: list[Any]
    command_examples: list[Any]
    references: list[Any]
    teachable_references: list[Any]
    faults: dict[str, Any]
    monitoring: dict[str, Any]
    channels: dict[str, Any]
    control_sources: list[Any]
    signal_paths: list[Any]
    communication_fault: dict[str, Any]
    memory: dict[str, Any]
    start_up: list[Any]
    predecessors: list[Any]
    connectors: list[Any]
    line_rules: list[Any]
    schematics: list[Any]
    wiring: dict[str, Any]
    parts: list[Any]
    masters: list[Any]
    keypad_functions: list[Any]
    groups: list[Any]
    enumerations: list[Any]
    parameters: list[Any]


class WiringRowField(DocumentPart):
    """One fact about the line of a family."""

    head: str
    text: str
    sure: Annotated[str, Meta(description="Certainty of the fact; empty if the manual states it.")]
    warns: bool


class WiringSectionField(DocumentPart):
    """Facts of one subject."""

    title: str
    rows: list[WiringRowField]


class WiringDocument(Document, kw_only=True):
    """`profiles ID --wiring`."""

    command: Literal["profiles"] = "profiles"
    id: str
    name: str
    sections: list[WiringSectionField]


class CheckDocument(Document, kw_only=True):
    """`profiles --check`: one file of the list."""

    command: Literal["profiles"] = "profiles"
    file: str
    faults: list[str]
    hints: list[str]
    """Probable mistakes of a file without faults."""


class ProofStepField(DocumentPart, kw_only=True):
    """A step of `profiles --prove`."""

    name: str
    passed: bool
    file: str | None
    """File with the claim that failed; null if it passed."""
    line: int | None
    fault: str | None


class ProofDocument(Document, kw_only=True):
    """`profiles --prove`: one file of the list."""

    command: Literal["profiles"] = "profiles"
    file: str
    passed: bool
    faults: list[str]
    """Faults that `--check` reports; with one, no step was carried out."""
    steps: list[ProofStepField]
    not_tested: list[str]
    """Subjects that no step tested, with what the file lacks: a sentence each."""


class ProfileBegun(Document, kw_only=True):
    """`profiles new`."""

    command: Literal["profiles"] = "profiles"
    id: str
    from_: str = msgspec.field(name="from")
    file: str


class ProfileFolder(Document, kw_only=True):
    """`profiles path`."""

    command: Literal["profiles"] = "profiles"
    folder: str


class SimulatedDriveField(DocumentPart):
    """A simulated drive."""

    profile: str
    device: int


class BehaviorField(DocumentPart):
    """One behavior of a simulated drive, and where it is from."""

    text: str
    provenance: Literal["printed", "public", "guess"]
    source: str


class SimulatedBehaviorDocument(Document, kw_only=True):
    """`simulate --about`: the behavior of the simulated drives of a profile."""

    command: Literal["simulate"] = "simulate"
    profile: str
    behaviors: list[BehaviorField]


class GhostField(DocumentPart):
    """A drive played from a record, whose first exchange was at `begun`."""

    device: int
    profile: str | None
    file: str
    begun: str
    seconds: float
    repeats: bool


class SimulationReady(Document, kw_only=True):
    """`simulate`: the line is served."""

    command: Literal["simulate"] = "simulate"
    event: Literal["ready"] = "ready"
    line: str
    drives: list[SimulatedDriveField]
    ghosts: list[GhostField]


class GhostDocument(Document, kw_only=True):
    """`simulate`: a record ended or began again, or does not have a request; once for each."""

    command: Literal["simulate"] = "simulate"
    event: Literal["ghost"] = "ghost"
    text: str


class ServeReady(Document, kw_only=True):
    """`serve`: the lines are open; `tcp` is the LINE by which others reach them, null without.

    `metrics` is the URL of the metrics, `mqtt` that of the broker with the topic.
    """

    command: Literal["serve"] = "serve"
    event: Literal["ready"] = "ready"
    lines: list[str]
    tcp: str | None
    metrics: str | None
    mqtt: str | None
    writes: list[str]
    commands: bool


class PublishReady(Document, kw_only=True):
    """`publish`: publishing has begun; `mqtt` is the URL of the broker with the topic."""

    command: Literal["publish"] = "publish"
    event: Literal["ready"] = "ready"
    mqtt: str


class BenchStateField(DocumentPart):
    """Real state of a simulated drive; `shaft_hz` is signed by the direction, `current` in A."""

    powered: bool
    fault: str | None
    output_hz: float
    shaft_hz: float
    current: float
    mains: float
    wire_cut: bool
    jammed: bool
    planted: list[str]


class InputsDocument(Document, kw_only=True):
    """`simulate`: inputs of a drive were set or asked for; `time` is in s since the start."""

    command: Literal["simulate"] = "simulate"
    event: Literal["inputs"] = "inputs"
    text: str
    time: float
    device: int
    drive: BenchStateField


class BenchDocument(Document, kw_only=True):
    """`simulate`: a line of the bench was carried out; `time` is in s since the start."""

    command: Literal["simulate"] = "simulate"
    event: Literal["bench"] = "bench"
    text: str
    time: float
    device: int
    drive: BenchStateField


class BenchWaitsDocument(Document, kw_only=True):
    """`simulate`: a line waits for its time; `waiting` lines do so."""

    command: Literal["simulate"] = "simulate"
    event: Literal["waits"] = "waits"
    text: str
    waiting: int


class BenchRefusedDocument(Document, kw_only=True):
    """`simulate`: a line from a socket was refused; nothing was changed."""

    command: Literal["simulate"] = "simulate"
    event: Literal["refused"] = "refused"
    text: str
    error: str


class BundleDocument(Document, kw_only=True):
    """`bundle`: the file, what is in it, and why other files are not."""

    command: Literal["bundle"] = "bundle"
    line: str
    file: str
    bytes: int
    files: list[str]
    missing: Annotated[dict[str, str], Meta(description="Reasons by the name of the file.")]
    omitted: Annotated[
        dict[str, int], Meta(description="Names and passwords that were replaced: places by kind.")
    ]
    messages: list[str]
