"""Description of each field of a profile in a sentence, for its JSON schema.

A field that has a text below it in `schema` is described there; the others are here.
"""

from __future__ import annotations

import ast
import inspect
import sys
import textwrap
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise

COMMON: Mapping[str, str] = {
    "id": "Its name inside the profile, in small letters.",
    "name": "What a person reads, short.",
    "code": "The code that the drive's keypad and manual call it by.",
    "raw": "The raw value, as the line carries it.",
    "parameter": "Code of a parameter of this profile.",
    "note": "What else a person should know.",
    "source": "The id of its source and the place in it.",
    "confidence": "How surely it is known.",
    "remedy": "What to do about it.",
    "mask": "Bits of the word that count.",
    "shift": "How many bits the word is shifted down first.",
    "bit": "Number of the bit, 0 to 15.",
}
"""Texts by the name of a field, where its table says nothing else."""

OWN: Mapping[str, Mapping[str, str]] = {
    "When": {"values": "Raw values of the parameter with which the condition holds."},
    "Block": {
        "direction": "Whether the block is read or written.",
        "address": "Wire address of its first word.",
        "min_words": "Fewest words of one access.",
        "max_words": "Most words of one access.",
        "selects_by": "Whether a slot holds a number out of `choices` or a wire address.",
        "choices": "What each number of a slot stands for.",
        "write_when": "Whether slots are written at any time or with the motor stopped.",
        "effective": "When a changed slot is in force.",
    },
    "State": {
        "kind": "What the state means for a person; the same words on every family.",
        "value": "The word behind the mask while the drive is in this state.",
    },
    "Transition": {
        "number": "Its number in the manual.",
        "source": "State that it leads from.",
        "target": "State that it leads to.",
        "edge_bit": "Bit whose rising edge makes it; absent where the word as a whole does.",
        "name": "The manual's name of the command or event.",
    },
    "DirectionBit": {"reverse": "Value of the bit while the motor turns in reverse."},
    "StatusBit": {"value": "Value of the bit with which it holds."},
    "ChannelBits": {"names": "Who commands, by the value of those bits in decimal."},
    "Order": {
        "id": "Which command it carries out.",
        "words": "Words written one after another.",
    },
    "Interlock": {"remedy": "What to do, as a sentence."},
    "OptionChoice": {"bits": "The bits behind the option's mask."},
    "CommandOption": {
        "choices": "Its settings.",
        "stopped_only": "True where it is changed with the motor stopped only.",
    },
    "Chart": {
        "status": "Code of the status word.",
        "command": "Code of the command word; empty where nothing is commanded.",
        "states": "States in the order in which they are looked for: the first that fits counts.",
        "transitions": "Commands and events that lead from state to state.",
        "orders": "What a person may command, as words.",
        "interlocks": "What must hold before a command that can move the motor.",
        "options": "Bits of a command word that stay from command to command.",
        "direction": "The bit that shows the direction of rotation.",
        "reached": "The bit that shows that the reference is reached.",
        "alarm": "The bit that shows an alarm.",
        "local": "The bit that shows that the drive is commanded locally.",
        "channel": "The bits that show who commands.",
    },
    "CommandExample": {"word": "The whole command word.", "does": "What it does."},
    "ScaleWhen": {"values": "Raw values of the parameter with which the condition holds."},
    "ReferenceWay": {
        "kind": "Whether the word is a frequency or a speed.",
        "signed": "True where a negative reference turns the motor in reverse.",
        "feedback": "Code of the word with the reference as the drive accepted it.",
    },
    "Setting": {"value": "The raw value that it is to hold."},
    "Way": {"switch": "What chooses between two sources, in words."},
    "ControlSource": {
        "command": "Where the command comes from.",
        "reference": "Where the reference comes from.",
    },
    "Source": {"title": "Title of the document, with its edition."},
    "Erratum": {
        "place": "Document and place.",
        "printed": "What is printed there.",
        "right": "What is right.",
        "why": "How that is known.",
    },
    "ProfileHead": {
        "id": "The id as typed with -p, in small letters.",
        "name": "Name of the drive family.",
        "vendor": "Maker of the drive family.",
        "version": "Version of this file.",
        "summary": "What the profile rests on, in a sentence.",
    },
    "IdentificationObject": {
        "id": "Number of the object.",
        "meaning": "What the object holds.",
    },
    "Model": {
        "code": "The code word of the model.",
        "reference": "Its reference, as ordered.",
        "voltage": "Its mains voltage.",
        "power_kw": "Its rated power in kW.",
        "variant": "What sets it apart.",
        "class_b": "True for a model with the class bit set.",
    },
    "Identification": {
        "objects": "Objects that the drive answers to function 43.",
        "conformity": "Conformity level of function 43.",
        "highest_read_device_id": "Highest read code that function 43 takes.",
        "model_parameter": "Code of the word that shows the model.",
        "class_parameter": "Code of the word with the class bit.",
        "class_bit": "The bit that distinguishes two classes of models.",
        "models": "Models by their code.",
    },
    "LinkChoice": {
        "text": "What a person reads.",
        "baud": "Bits per second.",
        "format": "Data bits, parity and stop bits.",
        "parity": "Parity.",
    },
    "LinkSetting": {
        "role": "What it sets of the drive's side of the line.",
        "factory": "Its raw value as the drive leaves the factory.",
        "choices": "Its raw values and what they mean on the line.",
    },
    "LinkSettings": {
        "baud": "Bits per second from the factory; taken where a LINE names none.",
        "format": "Data bits, parity, stop bits from the factory; taken where a LINE names none.",
        "formats": "Formats that the drive can be set to.",
        "bauds": "Bit rates that the drive can be set to.",
        "end_of_frame_characters": "Silence that ends a frame, in characters.",
        "settings": "Parameters of the drive that set its side of the line.",
    },
    "Addresses": {
        "first": "Lowest slave address.",
        "last": "Highest slave address.",
        "factory": "Slave address from the factory.",
        "broadcast": "Address that every drive hears.",
        "servers": "Further Modbus servers in the same drive.",
    },
    "Function": {
        "code": "Number of the Modbus function.",
        "max_read": "Most words of one read.",
        "max_write": "Most words of one write.",
        "broadcast": "True where the drive takes it as a broadcast.",
        "past_limit": "What the drive does with a request past its limit.",
        "past_limit_exception": "Exception code of such a request.",
        "subfunctions": "Sub-functions of function 8 that the drive has.",
    },
    "PortCounters": {
        "name": "The port, as a person calls it.",
        "frames": "Parameter that counts frames to the drive, modulo 65536.",
        "checksum_errors": "Parameter that counts those with a wrong checksum, up to 65535.",
    },
    "ExceptionCode": {
        "code": "The exception code.",
        "meaning": "What it means on this family.",
    },
    "Pin": {"pin": "Number of the pin.", "signal": "Its signal."},
    "Connector": {"pins": "Its pins.", "warnings": "What must not be done with it."},
    "LineRule": {"subject": "What it is about.", "rule": "The rule, as a sentence."},
    "MemoryOrders": {
        "save": "Saving the settings.",
        "factory": "Recalling the factory settings.",
    },
    "SpeedFormula": {
        "frequency": "Code of the output frequency.",
        "poles": "Code of the number of poles.",
        "result": "Code of the word that holds the result.",
    },
    "Monitoring": {
        "values": "What is watched, in the order of a print-out.",
        "speed_from": "How the drive works out its speed.",
    },
    "FaultCode": {
        "code": "The code on the drive's display.",
        "cause": "What made it.",
    },
    "LookAt": {"why": "What it shows about this fault."},
    "Hint": {
        "check": "What to check, one thing each.",
        "look_at": "Parameters to look at, and why.",
    },
    "FamilyWarning": {"text": "The warning, as a sentence."},
    "Lamp": {"tells": "What it indicates."},
    "SignalName": {"signal": "The signal as this profile calls it."},
    "StartUpStep": {"stopped_only": "True where the motor must be at rest."},
    "FactoryBy": {"raws": "The factory setting by the other parameter's raw value, in decimal."},
    "Multiple": {"times": "How many times that parameter, a decimal in quotes."},
    "Faults": {
        "history": "Codes of the past faults, the latest first; the first may be `parameter`.",
        "codes": "What each raw fault code means.",
        "help": "What each fault points at.",
        "none": "Raw value that means no fault.",
    },
    "Reaction": {
        "code": "The manual's code of it.",
        "does": "What the drive does, in words.",
        "trips": "True where the drive goes into fault.",
        "motor_keeps_running": "True where the motor runs on.",
    },
    "CommunicationFault": {
        "timeout": "Code of the timeout.",
        "reaction": "Code of what chooses the reaction.",
        "reactions": "What each value of it does.",
        "fault": "Raw code of the fault that follows.",
        "warnings": "What a person must know of it.",
    },
    "Enumeration": {"values": "Names by raw value, in decimal."},
    "Bit": {"off": "What 0 means.", "on": "What 1 means."},
    "ScaleBy": {"scales": "The scale by the other parameter's raw value, in decimal."},
    "UnitBy": {"units": "The unit by the value of those bits, in decimal."},
    "ParameterGroup": {"holds": "Whether its parameters are settings, commands or measurements."},
    "Parameter": {
        "name": "What it is, short and without a unit.",
        "address": "The address on the wire, as in a frame.",
        "type": "How many words it has, and whether it has a sign.",
        "unit": "Its unit.",
        "scale": "What one count is worth, a decimal in quotes.",
        "scale_by": "A scale that follows another parameter.",
        "unit_by": "A unit that follows another parameter.",
        "min": "Lowest raw value.",
        "max": "Highest raw value.",
        "min_from": "Parameter below which it must not be.",
        "min_of": "Lowest value, where it is so many times another parameter.",
        "factory_of": "Factory setting that is so many times another parameter.",
        "factory": "Raw value as the drive leaves the factory.",
        "enumeration": "Id of the names of its raw values.",
        "bits": "Its bits, for a bit word.",
        "access": "Who may write it and when: rw-stopped with the motor stopped only.",
        "storage": "Where the drive keeps it.",
        "effective": "When a written value is in force.",
        "group": "The menu that it is shown in.",
    },
    "ProfileData": {
        "profile": "The head of the file, first in it.",
        "sources": "Documents that the facts were taken from.",
        "errata": "Places where a manual is wrong.",
        "identification": "How the drive is recognized.",
        "link": "The line from the factory, and the parameters behind it.",
        "addresses": "Slave addresses.",
        "functions": "Modbus functions and their limits.",
        "port_counters": "Parameters in which the drive counts frames, by port.",
        "reading": "Which reads the drive answers.",
        "blocks": "Indirect blocks and communication scanners.",
        "exceptions": "What exception codes mean.",
        "charts": "State charts with their commands.",
        "command_examples": "Whole command words and what they do.",
        "references": "Ways to give the drive its frequency or speed.",
        "teachable_references": "Words of unknown scale that may take the reference once taught.",
        "channels": "Which words show what commands and what gives the reference now.",
        "faults": "Where faults are read and what they mean.",
        "monitoring": "What is watched.",
        "control_sources": "Who commands and who gives the reference.",
        "communication_fault": "The drive's watch over the line.",
        "memory": "Words that save and recall settings.",
        "start_up": "The first commissioning, a step a table, in its order.",
        "connectors": "Connectors and their pins.",
        "line_rules": "Rules for the wiring.",
        "wiring": "What to know before touching the line or the drive.",
        "groups": "What the parameters of a group are.",
        "enumerations": "Names of raw values that several parameters share.",
        "parameters": "Last in the file, one table a parameter.",
    },
}
"""Texts by table and field."""


@lru_cache(maxsize=128)
def _written_below(table: type) -> Mapping[str, str]:
    """Texts below the fields of a table in its source."""
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
        if text := _written_below(kind).get(field) or OWN.get(kind.__name__, {}).get(field):
            return text
    return COMMON.get(field, "")
