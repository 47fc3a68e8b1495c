"""Identity in a profile, and recognition of a drive of its family."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import BitNumber, DecimalText, Identifier, Table


class Source(Table, frozen=True, kw_only=True):
    """A document that facts were taken from."""

    id: Identifier
    title: str
    note: str = ""


class Erratum(Table, frozen=True, kw_only=True):
    """An error or contradiction in a manual, and what this profile follows."""

    place: str
    printed: str
    right: str
    why: str = ""


class ProfileHead(Table, frozen=True, kw_only=True):
    """First table of a profile; a listing reads no more."""

    id: Identifier
    name: str
    vendor: str
    version: str
    summary: str = ""
    demo_hz: DecimalText | None = None
    """Frequency at which its motor runs in the demo; absent: it is not in the demo."""
    address: str = ""
    """Rule for the wire address of parameters without one: `10 * number - 1`."""
    eeprom_address: str = ""
    """Rule for the EEPROM address of settings without one that are `ram-until-saved`."""
    rows_from: list[str] = []
    """Files of rows shared by several families, in the folder of this file; a row here with the
    same key contains the differences."""
    unproved: bool = False
    """True if it is written from public documents, and no drive has confirmed it: read at once,
    written only after a person confirms."""
    without: list[str] = []
    """Codes of shared parameters that this family does not have."""


class IdentificationObject(Table, frozen=True, kw_only=True):
    """One object of the answer to function 43/14."""

    id: Annotated[int, Meta(ge=0, le=255)]
    meaning: Literal["vendor", "reference", "version", "name"]
    example: str = ""
    """Reply of a simulated drive."""


class Model(Table, frozen=True, kw_only=True):
    """A model known by a code word of the drive, with its rating."""

    code: int
    reference: str = ""
    voltage: str = ""
    power_kw: str = ""
    variant: str = ""
    class_b: bool = False


class IdentityRegister(Table, frozen=True, kw_only=True):
    """A parameter that shows the family of a drive."""

    parameter: str
    values: list[int] = []
    """Raw values that only drives of this family have."""
    begins: list[str] = []
    """Instead of values: beginnings of a text (`ascii`)."""


class Identification(Table, frozen=True, kw_only=True):
    """Recognition of a drive of this family."""

    reference_prefixes: list[str] = []
    """Beginnings of object 1 (reference) that belong to this family; of the text of function 17 if
    the drive does not support function 43."""
    registers: list[IdentityRegister] = []
    """Registers that show the family if the drive does not report its reference; all must fit."""
    objects: list[IdentificationObject] = []
    version_digits: Literal["as-told", "two-and-two"] = "as-told"
    """`two-and-two` if 0201 means version 2.1."""
    conformity: int = 1
    highest_read_device_id: Annotated[int, Meta(ge=1, le=4)] = 1
    exception_has_mei_byte: bool = False
    """True if the exception to function 43 has the MEI byte before the code."""
    model_parameter: str = ""
    class_parameter: str = ""
    class_bit: BitNumber | None = None
    models: list[Model] = []
    note: str = ""
    source: str = ""
