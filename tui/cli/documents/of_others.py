"""Documents about ports, profiles and simulated lines."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from .of_drives import DocumentTold


class PortTold(DocumentTold, kw_only=True):
    """`ports`: one port of the list."""

    command: Literal["ports"]
    path: str
    description: str
    holder: str | None


class ProfileTold(DocumentTold, kw_only=True):
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


class WiringTold(DocumentTold, kw_only=True):
    """`profiles ID --wiring`."""

    command: Literal["profiles"]
    id: str
    name: str
    sections: list[dict[str, Any]]


class CheckTold(DocumentTold, kw_only=True):
    """`profiles --check`: one file of the list."""

    command: Literal["profiles"]
    file: str
    faults: list[str]


class ProfileBegun(DocumentTold, kw_only=True):
    """`profiles new`."""

    command: Literal["profiles"]
    id: str
    from_: str = msgspec.field(name="from")
    file: str


class ProfileFolder(DocumentTold, kw_only=True):
    """`profiles path`."""

    command: Literal["profiles"]
    folder: str


class SimulationReady(DocumentTold, kw_only=True):
    """`simulate`: the line is served."""

    command: Literal["simulate"]
    event: Literal["ready"]
    line: str
    drives: list[dict[str, str | int]]


class InputsTold(DocumentTold, kw_only=True):
    """`simulate`: inputs of a drive were set or asked for."""

    command: Literal["simulate"]
    event: Literal["inputs"]
    text: str
