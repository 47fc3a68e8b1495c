"""Documents about ports, profiles and simulated lines."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from .counter_parts import LastMinuteField
from .drive_documents import Document
from .parts import LeftBehindDocument


class PortDocument(Document, kw_only=True):
    """`ports`: one port of the list."""

    command: Literal["ports"]
    path: str
    description: str
    holder: str | None
    lasting: str | None
    """The link that is this adapter's, or its socket's, for good; null where there is none."""
    adapter: str | None
    """USB vendor, product and serial number; null for a port that is not on USB."""


class NamedLineField(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A line that the settings file names."""

    name: str
    line: str
    device: int | None
    profile: str | None


class KnownDriveField(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A drive that answered at an address when its line was used last."""

    device: int
    vendor: str | None
    reference: str | None
    version: str | None
    name: str | None
    profile: str | None


class KnownLineField(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Stored facts of a line."""

    line: str
    adapter: str | None
    drives: list[KnownDriveField]


class LeftOnLineDocument(LeftBehindDocument, kw_only=True):
    """The same with its place."""

    line: str
    device: int


class LineClientDocument(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A program on a line that is open."""

    program: str
    pid: int
    share: float
    """Of the line's time, over about 10 s: 1 is all of it."""


class OpenLineDocument(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """A line that is open, and the process that holds it: `keeper` as a rule."""

    line: str
    program: str
    pid: int
    clients: list[LineClientDocument] | None
    """The programs on the line; null without an answer of its holder."""
    last_minute: LastMinuteField | None
    """Its health; null without an answer, or from a holder of an older version."""


class LinesDocument(Document, kw_only=True):
    """`lines`: the names, what is wrong with the settings file, and what is remembered."""

    command: Literal["lines"]
    settings: str
    faults: list[str]
    lines: list[NamedLineField]
    known: list[KnownLineField]
    open: list[OpenLineDocument]
    left_behind: list[LeftOnLineDocument]


class ProfileDocument(Document, kw_only=True):
    """`profiles`: one of the list."""

    command: Literal["profiles"]
    id: str
    name: str
    vendor: str
    parameters: int
    own: bool
    file: str
    remark: str


class ProfileShown(msgspec.Struct, kw_only=True):
    """`profiles ID`: the profile itself, as profiles/profile.schema.json describes it."""

    schema: Literal[1]
    command: Literal["profiles"]
    profile: dict[str, Any]
    parameters: list[dict[str, Any]]


class WiringDocument(Document, kw_only=True):
    """`profiles ID --wiring`."""

    command: Literal["profiles"]
    id: str
    name: str
    sections: list[dict[str, Any]]


class CheckDocument(Document, kw_only=True):
    """`profiles --check`: one file of the list."""

    command: Literal["profiles"]
    file: str
    faults: list[str]


class ProfileBegun(Document, kw_only=True):
    """`profiles new`."""

    command: Literal["profiles"]
    id: str
    from_: str = msgspec.field(name="from")
    file: str


class ProfileFolder(Document, kw_only=True):
    """`profiles path`."""

    command: Literal["profiles"]
    folder: str


class SimulationReady(Document, kw_only=True):
    """`simulate`: the line is served."""

    command: Literal["simulate"]
    event: Literal["ready"]
    line: str
    drives: list[dict[str, str | int]]


class ServeReady(Document, kw_only=True):
    """`serve`: the lines are open; `tcp` is the LINE by which others reach them, null without.

    `metrics` is the URL of the metrics, `mqtt` that of the broker with the topic.
    """

    command: Literal["serve"]
    event: Literal["ready"]
    lines: list[str]
    tcp: str | None
    metrics: str | None
    mqtt: str | None
    writes: list[str]
    commands: bool


class PublishReady(Document, kw_only=True):
    """`publish`: publishing has begun; `mqtt` is the URL of the broker with the topic."""

    command: Literal["publish"]
    event: Literal["ready"]
    mqtt: str


class InputsDocument(Document, kw_only=True):
    """`simulate`: inputs of a drive were set or asked for."""

    command: Literal["simulate"]
    event: Literal["inputs"]
    text: str


class JournalEntryField(msgspec.Struct, kw_only=True):
    """A write, a trip that was seen, or a proof; `read_back` is what the drive held in the end."""

    time: str
    line: str
    device: int
    profile: str
    code: str
    address: int
    old_raw: int | None
    old: str
    new_raw: int
    new: str
    answer: str
    read_back: int | None
    why: str
    kind: Literal["write", "fault", "read-back", "proof", "reset"]
    of: str


class DamagedLineField(msgspec.Struct, kw_only=True):
    """A damaged line of the journal, with its beginning."""

    file: str
    line: int
    text: str


class JournalDocument(Document, kw_only=True):
    """`journal`: what was written to drives from here, oldest first."""

    command: Literal["journal"]
    journal: str
    entries: list[JournalEntryField]
    damaged: list[DamagedLineField]


class BundleDocument(Document, kw_only=True):
    """`bundle`: the file, what is in it, and why other files are not."""

    command: Literal["bundle"]
    line: str
    file: str
    bytes: int
    files: list[str]
    missing: dict[str, str]
    """Reasons by the name of the file."""
    omitted: dict[str, int]
    """Names and passwords that were replaced: places by kind."""
    messages: list[str]
