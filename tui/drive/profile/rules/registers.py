"""Rules for registers: their places, and the functions that read and write them."""

from __future__ import annotations

from collections.abc import Iterator

from tui.drive.words import word_count
from tui.wire.frames import SPACES

from ..schema import Parameter, ProfileData
from ..toml_lines import TomlPath

MOST_WRITTEN, MOST_WRITTEN_BY_23 = 123, 121
"""Most words that a Modbus request can write: by function 16, and by function 23."""


def overlaps(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield parameters that share bits of a register."""
    held: dict[tuple[int, int], list[Parameter]] = {}
    for index, parameter in enumerate(data.parameters):
        for address in range(parameter.address, parameter.address + word_count(parameter)):
            others = held.setdefault((parameter.function, address), [])
            for other in others:
                if fault := _clash(parameter, other, address):
                    yield ("parameters", index, "address"), f"parameter {parameter.code}: {fault}"
                    break
            others.append(parameter)


def eeprom_addresses(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield EEPROM addresses that another word has, or whose parameter does not keep a value."""
    held = {
        (address + place): parameter.code
        for parameter in data.parameters
        if parameter.function == 3
        for address in (parameter.address,)
        for place in range(word_count(parameter))
    }
    for index, parameter in enumerate(data.parameters):
        first = parameter.eeprom_address
        if first is None:
            continue
        at: TomlPath = ("parameters", index, "eeprom_address")
        kept = parameter.access in ("rw", "rw-stopped") and parameter.storage == "ram-until-saved"
        if not kept or parameter.function != 3 or parameter.mask != 0xFFFF or parameter.shift:
            yield (
                at,
                f"parameter {parameter.code}: an EEPROM address needs a whole word with access rw"
                " and storage ram-until-saved.",
            )
        if data.memory.save is not None:
            yield (
                at,
                f"parameter {parameter.code}: a family has [memory.save] or EEPROM addresses, not"
                " both.",
            )
        for address in range(first, first + word_count(parameter)):
            if (other := held.get(address)) is not None:
                yield (
                    at,
                    f"parameter {parameter.code}: EEPROM address {address} also belongs to"
                    f" {other}.",
                )
                break
            held[address] = parameter.code
        if address > 0xFFFF:
            yield at, f"parameter {parameter.code}: its EEPROM address exceeds 65535."


def _clash(parameter: Parameter, other: Parameter, address: int) -> str:
    """Return why two parameters cannot share an address; empty if they can."""
    if parameter.is_bits:
        return f"coil {address} already belongs to {other.code}."
    longer = parameter if word_count(parameter) > 1 else other
    if word_count(longer) > 1 or "ascii" in (parameter.type, other.type):
        return (
            f"address {address} also belongs to {other.code}: {longer.code} is {longer.type} and"
            f" uses {longer.address} to {longer.address + word_count(longer) - 1}."
        )
    bits, others = (p.mask << p.shift for p in (parameter, other))
    # a status word whose upper byte is the fault: each is read, neither is written
    inside = (bits == 0xFFFF) is not (others == 0xFFFF)
    if not bits & others or (inside and parameter.access == other.access == "r"):
        return ""
    if bits == others == 0xFFFF:
        return f"address {address} already belongs to {other.code}; fields need mask and shift."
    return f"bits 16#{bits & others:04X} of address {address} also belong to {other.code}."


def functions(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield parameters whose reading or writing lacks its function."""
    codes = {function.code for function in data.functions}
    read_by = {parameter.function for parameter in data.parameters}
    if 3 not in codes and (3 in read_by or not codes & set(SPACES)):
        yield ("functions",), "function 3 is missing, so nothing can be read."
    writes = codes & {6, 16}
    most_coils = next((f.max_write or 1 for f in data.functions if f.code == 15), 0)
    pairs = any(f.code == 16 and (f.max_write or 1) > 1 for f in data.functions)
    for index, parameter in enumerate(data.parameters):
        place = ("parameters", index)
        if parameter.function != 3 and parameter.function not in codes:
            yield (
                (*place, "function"),
                f"parameter {parameter.code}: function {parameter.function} is not among the"
                " functions. Add it.",
            )
        if parameter.access == "r" or parameter.forbidden:
            continue
        if parameter.is_bits:
            if not (parameter.words <= most_coils or (parameter.words == 1 and 5 in codes)):
                yield (*place, "access"), _coils_unwritten(parameter)
            continue
        if parameter.type.endswith("32") and 16 not in codes:
            yield (
                (*place, "access"),
                f"parameter {parameter.code}: two words are written by function 16, which is not"
                " among the functions. Add it, or set access r.",
            )
        elif parameter.type.endswith("32") and not pairs:
            yield (
                (*place, "access"),
                f"parameter {parameter.code}: two words are written at once, and function 16 has"
                " no max_write above 1. Add max_write, or set access r.",
            )
        elif not writes:
            yield (
                (*place, "access"),
                f"parameter {parameter.code}: it can be written only by function 6 or 16, and"
                " neither is among the functions. Add one, or set access r.",
            )


_COIL_UNWRITTEN = (
    "parameter {code}: a coil is written by function 5 or 15. Add the function, or set access r."
)
_COILS_UNWRITTEN = (
    "parameter {code}: {count} coils are written at once, by function 15 with a max_write of at"
    " least that. Add it, or set access r."
)


def _coils_unwritten(parameter: Parameter) -> str:
    text = _COIL_UNWRITTEN if parameter.words == 1 else _COILS_UNWRITTEN
    return text.format(code=parameter.code, count=parameter.words)


def whole_words(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield commands that are only a part of a word.

    Such a command would need a read before it, to keep the other bits.
    """
    fields = {p.code for p in data.parameters if p.shift or p.mask != 0xFFFF}
    for index, chart in enumerate(data.charts):
        places: list[tuple[TomlPath, str]] = [(("charts", index, "command"), chart.command)]
        places += [
            (("charts", index, "orders", n, "parameter"), order.parameter)
            for n, order in enumerate(chart.orders)
        ]
        for place, code in places:
            if code in fields:
                yield (
                    place,
                    f"chart {chart.id}: {code} is a part of a word; a command is a whole word.",
                )


def sizes(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield blocks and functions that are larger than a request, and blocks of coils."""
    bits = {parameter.code for parameter in data.parameters if parameter.is_bits}
    for index, function in enumerate(data.functions):
        if function.code == 23 and (function.max_write or 0) > MOST_WRITTEN_BY_23:
            yield (
                ("functions", index, "max_write"),
                f"function 23 writes at most {MOST_WRITTEN_BY_23} words, not {function.max_write}.",
            )
    for index, block in enumerate(data.blocks):
        at, most = ("blocks", index), block.max_words
        if block.direction == "write" and most > MOST_WRITTEN:
            yield (
                (*at, "max_words"),
                f"block {block.id}: a request writes at most {MOST_WRITTEN} words, not {most}.",
            )
        choices = [choice.parameter for choice in block.choices]
        for code in {*block.slots, *block.values, *choices} & bits:
            yield at, f"block {block.id}: {code} is on coils or inputs. A block holds registers."
        if block.min_words > most:
            yield (
                (*at, "min_words"),
                f"block {block.id}: min_words {block.min_words} is above max_words {most}.",
            )
        if block.address + most > 0x10000:
            yield (
                (*at, "address"),
                f"block {block.id}: {most} words from {block.address} exceed address 65535.",
            )


REGISTER_RULES = (whole_words, overlaps, eeprom_addresses, functions, sizes)
