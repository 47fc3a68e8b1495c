"""Identity in a profile, and recognition of a drive of its family."""

from typing import Annotated, Literal

from msgspec import Meta

from .base import BitNumber, DecimalText, Identifier, Table, about


class Source(Table, frozen=True, kw_only=True):
    """A document that facts were taken from."""

    id: Identifier
    title: Annotated[str, about("Title and edition of the document.")]
    note: str = ""


class Erratum(Table, frozen=True, kw_only=True):
    """An error or contradiction in a manual, and what this profile follows."""

    place: Annotated[str, about("Document and place in it.")]
    printed: Annotated[str, about("Text printed there.")]
    right: Annotated[str, about("Correct text.")]
    why: Annotated[str, about("Reason for the correction.")] = ""


class ProfileHead(Table, frozen=True, kw_only=True):
    """First table of a profile; a listing reads no more."""

    id: Annotated[Identifier, about("Id as typed with -p, in lower case.")]
    name: Annotated[str, about("Name of the drive family.")]
    vendor: Annotated[str, about("Manufacturer of the drive family.")]
    version: Annotated[str, about("Version of this file.")]
    summary: Annotated[str, about("Short description of the family.")] = ""
    demo_hz: Annotated[
        DecimalText | None,
        about("Frequency at which its motor runs in the demo; absent: it is not in the demo."),
    ] = None
    address: Annotated[
        str,
        about("Rule for the wire address of parameters without one: `10 * number - 1`."),
    ] = ""
    eeprom_address: Annotated[
        str,
        about("Rule for the EEPROM address of settings without one that are `ram-until-saved`."),
    ] = ""
    rows_from: Annotated[
        list[str],
        about(
            "Files of rows shared by several families, in the folder of this file; a "
            "row here with the same key contains the differences."
        ),
    ] = []
    unproved: Annotated[
        bool,
        about(
            "True if it is written from public documents, and no drive has confirmed "
            "it: read at once, written only after a person confirms."
        ),
    ] = False
    without: Annotated[
        list[str], about("Codes of shared parameters that this family does not have.")
    ] = []


class IdentificationObject(Table, frozen=True, kw_only=True):
    """One object of the answer to function 43/14."""

    id: Annotated[int, Meta(ge=0, le=255), about("Object number.")]
    meaning: Annotated[
        Literal["vendor", "reference", "version", "name"],
        about("Content of the object."),
    ]
    example: Annotated[str, about("Reply of a simulated drive.")] = ""


class Model(Table, frozen=True, kw_only=True):
    """A model known by a code word of the drive, with its rating."""

    code: Annotated[int, about("Code word of the model.")]
    reference: Annotated[str, about("Order reference of the model.")] = ""
    voltage: Annotated[str, about("Mains voltage of the model.")] = ""
    power_kw: Annotated[str, about("Rated power of the model, in kW.")] = ""
    variant: Annotated[str, about("Difference from other models.")] = ""
    class_b: Annotated[bool, about("True for a model with the class bit set.")] = False


class IdentityRegister(Table, frozen=True, kw_only=True):
    """A parameter that shows the family of a drive."""

    parameter: str
    values: Annotated[list[int], about("Raw values that only drives of this family have.")] = []
    begins: Annotated[list[str], about("Instead of values: beginnings of a text (`ascii`).")] = []


class Identification(Table, frozen=True, kw_only=True):
    """Recognition of a drive of this family."""

    reference_prefixes: Annotated[
        list[str],
        about(
            "Beginnings of object 1 (reference) that belong to this family; of the "
            "text of function 17 if the drive does not support function 43."
        ),
    ] = []
    registers: Annotated[
        list[IdentityRegister],
        about(
            "Registers that show the family if the drive does not report its "
            "reference; all must fit."
        ),
    ] = []
    objects: Annotated[
        list[IdentificationObject], about("Objects in the drive's reply to function 43.")
    ] = []
    version_digits: Annotated[
        Literal["as-told", "two-and-two"],
        about("`two-and-two` if 0201 means version 2.1."),
    ] = "as-told"
    conformity: Annotated[int, about("Conformity level of function 43.")] = 1
    highest_read_device_id: Annotated[
        int,
        Meta(ge=1, le=4),
        about("Highest read code that function 43 accepts."),
    ] = 1
    exception_has_mei_byte: Annotated[
        bool,
        about("True if the exception to function 43 has the MEI byte before the code."),
    ] = False
    model_parameter: Annotated[str, about("Code of the word that shows the model.")] = ""
    class_parameter: Annotated[str, about("Code of the word with the class bit.")] = ""
    class_bit: Annotated[
        BitNumber | None, about("Bit that distinguishes two classes of models.")
    ] = None
    models: Annotated[list[Model], about("Models by their code.")] = []
    note: str = ""
    source: str = ""
