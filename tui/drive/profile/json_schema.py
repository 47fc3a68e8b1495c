"""JSON Schema of a profile, for editors that complete and check TOML.

`python -m tui.drive.profile.json_schema` prints it; with `help` or `search`, that of another file.
The committed copies are in the folder `profiles`. A field is described by the text below it in
`schema`, else by a text of this module.
"""

from __future__ import annotations

import ast
import inspect
import json
import sys
import textwrap
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import msgspec

from .schema import FamilySearch, HelpData, ProfileData, ProfileEvidence, Table

COMMON: Mapping[str, str] = {
    "id": "Identifier inside the profile, in lower case.",
    "name": "Short name for display.",
    "code": "Code as on the drive's keypad and in its manual.",
    "raw": "Raw value as sent on the line.",
    "parameter": "Code of a parameter of this profile.",
    "note": "Further information for the reader.",
    "source": "Id of the source and the place in it.",
    "confidence": "Certainty of the fact.",
    "remedy": "Remedy.",
    "mask": "Bits of the word that are evaluated.",
    "shift": "Bits by which the word is first shifted right.",
    "bit": "Number of the bit, 0 to 15.",
}
"""Texts by field name, used if the table has no text of its own."""

OWN: Mapping[str, Mapping[str, str]] = {
    "When": {"values": "Raw values of the parameter for which the condition holds."},
    "Block": {
        "direction": "Direction of the block: read or written.",
        "address": "Wire address of the first word.",
        "min_words": "Minimum number of words per access.",
        "max_words": "Maximum number of words per access.",
        "selects_by": "Content of a slot: a number from `choices`, or a wire address.",
        "choices": "Parameter for each number in a slot.",
        "write_when": "When slots can be written: any time, or only with the motor stopped.",
        "effective": "When a changed slot takes effect.",
    },
    "State": {
        "kind": "Meaning of the state, in the same terms for every family.",
        "value": "Masked word while the drive is in this state.",
        "also": "Further words that must hold one of their values for this state.",
    },
    "Transition": {
        "number": "Number in the manual.",
        "source": "State before the transition.",
        "target": "State after the transition.",
        "edge_bit": "Bit whose rising edge triggers it; absent if the whole word does.",
        "name": "Name of the command or event in the manual.",
    },
    "DirectionBit": {"reverse": "Value of the bit while the motor runs in reverse."},
    "StatusBit": {"value": "Value of the bit for which the meaning applies."},
    "ChannelBits": {"names": "Command channels by the value of those bits, in decimal."},
    "Order": {
        "id": "Command that the words carry out.",
        "words": "Words written in sequence.",
    },
    "OrderWait": {"states": "States of which one must be reached before the next word."},
    "Interlock": {"remedy": "Remedy, as a sentence."},
    "OptionChoice": {"bits": "Masked bits of the option."},
    "CommandOption": {
        "choices": "Settings of the option.",
        "stopped_only": "True if it can be changed only with the motor stopped.",
    },
    "Chart": {
        "status": "Code of the status word.",
        "command": "Code of the command word; empty if the drive cannot be commanded.",
        "states": "States in order of evaluation; the first match applies.",
        "transitions": "Commands and events that lead from state to state.",
        "orders": "Commands available to the user, as words.",
        "interlocks": "Conditions for a command that can move the motor.",
        "options": "Bits of a command word that are kept between commands.",
        "direction": "Bit that shows the direction of rotation.",
        "reached": "Bit that shows that the reference has been reached.",
        "alarm": "Bit that shows an alarm.",
        "local": "Bit that shows that the drive is under local control.",
        "channel": "Bits that show the command channel.",
    },
    "CommandExample": {"word": "Complete command word.", "does": "Effect of the word."},
    "ScaleWhen": {"values": "Raw values of the parameter for which the condition holds."},
    "ReferenceWay": {
        "kind": "Type of reference: frequency or speed.",
        "signed": "True if a negative reference runs the motor in reverse.",
        "feedback": "Code of the word that shows the reference accepted by the drive.",
    },
    "Setting": {"value": "Required raw value."},
    "Way": {"switch": "Switch between two sources, in words."},
    "ControlSource": {
        "command": "Source of the command.",
        "reference": "Source of the reference.",
    },
    "PathSwitch": {
        "name": "Name of the switch, as short as its code.",
        "positions": "Positions of the switch; the first one whose conditions hold applies.",
    },
    "SignalPath": {"carries": "Signal on the path."},
    "Source": {"title": "Title and edition of the document."},
    "Erratum": {
        "place": "Document and place in it.",
        "printed": "Text printed there.",
        "right": "Correct text.",
        "why": "Reason for the correction.",
    },
    "ProfileHead": {
        "id": "Id as typed with -p, in lower case.",
        "name": "Name of the drive family.",
        "vendor": "Manufacturer of the drive family.",
        "version": "Version of this file.",
        "summary": "Short description of the family.",
    },
    "IdentificationObject": {
        "id": "Object number.",
        "meaning": "Content of the object.",
    },
    "Model": {
        "code": "Code word of the model.",
        "reference": "Order reference of the model.",
        "voltage": "Mains voltage of the model.",
        "power_kw": "Rated power of the model, in kW.",
        "variant": "Difference from other models.",
        "class_b": "True for a model with the class bit set.",
    },
    "Identification": {
        "objects": "Objects in the drive's reply to function 43.",
        "conformity": "Conformity level of function 43.",
        "highest_read_device_id": "Highest read code that function 43 accepts.",
        "model_parameter": "Code of the word that shows the model.",
        "class_parameter": "Code of the word with the class bit.",
        "class_bit": "Bit that distinguishes two classes of models.",
        "models": "Models by their code.",
    },
    "LinkChoice": {
        "text": "Text for display.",
        "baud": "Baud rate in bit/s.",
        "format": "Data bits, parity and stop bits.",
        "parity": "Parity.",
    },
    "LinkSetting": {
        "role": "Line property set by the parameter.",
        "factory": "Raw value of the factory setting.",
        "choices": "Raw values and their meaning on the line.",
    },
    "LinkSettings": {
        "baud": "Factory baud rate in bit/s; used if a LINE gives none.",
        "format": "Factory data bits, parity and stop bits; used if a LINE gives none.",
        "formats": "Formats that the drive supports.",
        "bauds": "Baud rates that the drive supports.",
        "end_of_frame_characters": "Inter-frame gap that ends a frame, in characters.",
        "settings": "Parameters of the drive that set its line settings.",
    },
    "Addresses": {
        "first": "Lowest slave address.",
        "last": "Highest slave address.",
        "factory": "Factory slave address.",
        "broadcast": "Broadcast address, received by every drive.",
        "servers": "Further Modbus servers in the same drive.",
    },
    "Function": {
        "code": "Modbus function code.",
        "max_read": "Maximum number of words per read.",
        "max_write": "Maximum number of words per write.",
        "broadcast": "True if the drive accepts it as a broadcast.",
        "past_limit": "Reaction of the drive to a request above its limit.",
        "past_limit_exception": "Exception code returned for such a request.",
        "subfunctions": "Sub-functions of function 8 that the drive supports.",
    },
    "PortCounters": {
        "name": "Name of the port for display.",
        "frames": "Parameter that counts frames addressed to the drive, modulo 65536.",
        "checksum_errors": "Parameter that counts frames with a wrong checksum, up to 65535.",
    },
    "ExceptionCode": {
        "code": "Exception code.",
        "meaning": "Meaning in this family.",
    },
    "Pin": {"pin": "Pin number.", "signal": "Signal of the pin."},
    "Connector": {"pins": "Pins of the connector.", "warnings": "Warnings for the connector."},
    "LineRule": {"subject": "Subject of the rule.", "rule": "The rule, as a sentence."},
    "MemoryOrders": {
        "save": "Command that saves the settings.",
        "factory": "Command that restores the factory settings.",
    },
    "SpeedFormula": {
        "frequency": "Code of the output frequency.",
        "poles": "Code of the number of poles.",
        "result": "Code of the word that contains the result.",
    },
    "Monitoring": {
        "values": "Monitored values in the order of a printout.",
        "speed_from": "Formula for the drive's speed.",
    },
    "FaultCode": {
        "code": "Code on the drive's display.",
        "cause": "Cause of the fault.",
    },
    "LookAt": {"why": "Information that it gives on this fault."},
    "Hint": {
        "check": "Checks, one per entry.",
        "look_at": "Parameters to check, and why.",
    },
    "FamilyWarning": {"text": "Warning, as a sentence."},
    "Lamp": {"tells": "Meaning of the lamp."},
    "LineSchematic": {
        "length_baud": "Baud rate in bit/s for which the length applies.",
        "most_polarized_ohm": "Polarization at the master in ohm for which that number applies.",
    },
    "SignalName": {"signal": "Name of the signal in this profile."},
    "StartUpStep": {"stopped_only": "True if the motor must be at standstill."},
    "FactoryBy": {"raws": "Factory settings by the other parameter's raw value, in decimal."},
    "Multiple": {"times": "Factor for that parameter, a decimal in quotes."},
    "Faults": {
        "history": "Codes of past faults, latest first; the first may be `parameter`.",
        "codes": "Meaning of each raw fault code.",
        "help": "Help on each fault.",
        "none": "Raw value that means no fault.",
    },
    "Reaction": {
        "code": "Code in the manual.",
        "does": "Reaction of the drive, in words.",
        "trips": "True if the drive trips.",
        "motor_keeps_running": "True if the motor keeps running.",
    },
    "CommunicationFault": {
        "timeout": "Code of the timeout parameter.",
        "reaction": "Code of the parameter that selects the reaction.",
        "reactions": "Reaction for each value.",
        "fault": "Raw code of the resulting fault.",
        "warnings": "Warnings on communication loss.",
    },
    "Enumeration": {"values": "Names by raw value, in decimal."},
    "Bit": {"off": "Meaning of 0.", "on": "Meaning of 1."},
    "ScaleBy": {"scales": "Scales by the other parameter's raw value, in decimal."},
    "UnitBy": {"units": "Units by the value of those bits, in decimal."},
    "ParameterGroup": {"holds": "Content of the group: settings, commands or measurements."},
    "Parameter": {
        "name": "Short name without a unit.",
        "address": "Wire address, as in a frame, or a rule for it: 10 * number - 1.",
        "type": "Number of words, and signed or unsigned.",
        "unit": "Unit.",
        "scale": "Value of one count, a decimal in quotes.",
        "scale_by": "Scale that depends on another parameter.",
        "full_scale": "Full scale that is the value of another parameter.",
        "unit_by": "Unit that depends on another parameter.",
        "min": "Lowest raw value.",
        "max": "Highest raw value.",
        "min_from": "Parameter that gives a lower limit.",
        "min_of": "Lowest value as a multiple of another parameter.",
        "factory_of": "Factory setting as a multiple of another parameter.",
        "factory": "Raw value of the factory setting.",
        "enumeration": "Id of the enumeration with the names of its raw values.",
        "bits": "Bits of a bit word.",
        "access": "Access: r, rw, rw-stopped (written only with the motor stopped) or w.",
        "storage": "Memory in which the drive stores it.",
        "effective": "When a written value takes effect.",
        "group": "Menu in which it is shown.",
    },
    "ProfileData": {
        "profile": "Head of the file; must be the first table.",
        "sources": "Documents from which the facts were taken.",
        "errata": "Errors in the manuals.",
        "identification": "Recognition of the drive.",
        "link": "Factory line settings and their parameters.",
        "addresses": "Slave addresses.",
        "functions": "Modbus functions and their limits.",
        "port_counters": "Parameters that count frames, by port.",
        "reading": "Reads that the drive answers.",
        "blocks": "Indirect blocks and communication scanners.",
        "exceptions": "Meaning of exception codes.",
        "frames": "Example frames that the drive answers.",
        "charts": "State charts and their commands.",
        "command_examples": "Complete command words and their effects.",
        "references": "Ways to give the drive its frequency or speed.",
        "teachable_references": "Words that can take the reference once their scale is learned.",
        "channels": "Words that show the active command and reference channels.",
        "faults": "Fault registers and the meaning of faults.",
        "monitoring": "Monitored values.",
        "control_sources": "Configurations of command and reference source.",
        "signal_paths": "Switches between the sources of command and reference and the motor.",
        "communication_fault": "The drive's communication monitoring.",
        "memory": "Words that save settings or restore factory settings.",
        "start_up": "First commissioning in order, one table per step.",
        "predecessors": "Families that this one replaces, and settings that mean the same.",
        "connectors": "Connectors and their pins.",
        "line_rules": "Rules for the wiring.",
        "wiring": "Facts to know before touching the line or the drive.",
        "schematics": "Schematics of the line, with their limits.",
        "parts": "Parts for the line, by catalog number.",
        "masters": "Cables from the master to the line.",
        "keypad_functions": "Functions of the keypad without an address on the line.",
        "groups": "Content of groups that hold no settings.",
        "enumerations": "Names of raw values that several parameters share.",
        "parameters": "Parameters, one table each; must be last in the file.",
    },
}
"""Texts by table and field."""


@lru_cache(maxsize=128)
def texts_below(table: type) -> Mapping[str, str]:
    """Return the texts below the fields of a table in its source."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(table))).body[0]
    body = tree.body if isinstance(tree, ast.ClassDef) else []
    found: dict[str, str] = {}
    for field, text in pairwise(body):
        if not isinstance(field, ast.AnnAssign) or not isinstance(field.target, ast.Name):
            continue
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
            found[field.target.id] = " ".join(str(text.value.value).split())
    return found


def field_text(table: str, field: str) -> str:
    """Return the description of a table's field; empty if there is none."""
    schema = sys.modules["tui.drive.profile.schema"]
    struct = getattr(schema, table, None)
    kinds = struct.__mro__ if isinstance(struct, type) else ()
    for kind in (cls for cls in kinds if cls.__module__.startswith(schema.__name__)):
        if text := texts_below(kind).get(field) or OWN.get(kind.__name__, {}).get(field):
            return text
    return COMMON.get(field, "")


SCHEMA_FORMS: dict[str, tuple[type[Table], str]] = {
    "profile": (ProfileData, "Drive Panel profile"),
    "help": (HelpData, "Drive Panel help of faults"),
    "search": (FamilySearch, "Drive Panel words of a search"),
    "evidence": (ProfileEvidence, "Drive Panel evidence about a profile"),
}
"""The forms of files and their titles."""


def profile_schema(form: str = "profile") -> dict[str, Any]:
    """Return the schema as a dictionary, made from the structs into which files are decoded."""
    kind, title = SCHEMA_FORMS[form]
    (reference,), parts = msgspec.json.schema_components([kind], ref_template="#/$defs/{name}")
    for table, part in parts.items():
        for field, shape in part.get("properties", {}).items():
            if text := field_text(table, field):
                shape["description"] = text
    if (parameter := parts.get("Parameter")) is not None:
        # a file may have a rule instead, or leave it to the group or the profile
        place = parameter["properties"]["address"]
        parameter["properties"]["address"] = {
            "anyOf": [
                {key: place[key] for key in place if key != "description"},
                {"type": "string"},
            ],
            "description": place["description"],
        }
        parameter["required"].remove("address")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **reference,
        "$defs": dict(sorted(parts.items())),
    }


def described_parts(tables: Sequence[type[Table]]) -> dict[str, Any]:
    """Return the schemas of tables by their names, each field with the text below it."""
    _, parts = msgspec.json.schema_components(tables, ref_template="#/$defs/{name}")
    for table in tables:
        shapes = parts[table.__name__]["properties"]
        kinds = [kind for kind in table.__mro__[::-1] if issubclass(kind, Table)]
        for kind in kinds[1:]:  # the first one is Table itself
            names = dict(zip(kind.__struct_fields__, kind.__struct_encode_fields__, strict=True))
            for field, text in texts_below(kind).items():
                shapes[names[field]]["description"] = text
    return parts


def schema_text(form: str = "profile") -> str:
    return json.dumps(profile_schema(form), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text(*sys.argv[1:2]))
