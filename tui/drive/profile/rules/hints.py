"""Hints of `profiles --check`: places of a valid profile that are probably a mistake.

A hint never keeps a profile from loading.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from tui.drive.sentences import first_of

from ..schema import Parameter, ProfileData
from ..toml_lines import TomlPath

Hints = Iterator[tuple[TomlPath, str]]
Tables = Mapping[str, Any]

WRITABLE = ("rw", "rw-stopped")
SETTINGS_LISTED = 5
LEAST_PATTERN = 6
"""Fewest rows with a number that show a pattern of addresses."""
MANUAL_NUMBERS = ((3, 40001, ""), (4, 30001, ""), (3, 30001, " They need function = 4."),
                  (2, 10001, ""))  # fmt: skip
"""Function, first number of its registers in manuals, and what the rows need besides."""
NUMBERS_OF_KIND = 9999
"""Numbers from the first one on."""


def commands_by_storage(data: ProfileData, _: Tables) -> Hints:
    """Yield settings that are commands only because they are kept in RAM."""
    groups = {group.name for group in data.groups if group.holds != "settings"}
    used = {way.parameter for way in data.references}
    used |= {row.parameter for row in (data.memory.save, data.memory.factory) if row}
    for chart in data.charts:
        used |= {chart.command, *(order.parameter for order in chart.orders)}
        used |= {option.parameter for option in chart.options}
    for block in data.blocks:
        used |= {*block.values}
    found = [
        (index, parameter.code)
        for index, parameter in enumerate(data.parameters)
        if parameter.storage == "ram"
        and parameter.access in WRITABLE
        and (parameter.min, parameter.max, parameter.factory) != (None, None, None)
        and not parameter.holds
        and parameter.group not in groups
        and parameter.code not in used
        and not re.search("command|save|digital", parameter.quantity or "")
    ]
    if found:
        codes = first_of([code for _, code in found], SETTINGS_LISTED)
        yield (
            ("parameters", found[0][0], "storage"),
            f"storage ram makes a command of {codes}: no setting, and in no backup. A setting has"
            " eeprom, ram-until-saved or unknown.",
        )


def saved_by_nothing(data: ProfileData, _: Tables) -> Hints:
    """Yield the first setting that waits for a save, if nothing saves."""
    if data.memory.save is not None:
        return
    for index, parameter in enumerate(data.parameters):
        if parameter.storage == "ram-until-saved" and parameter.eeprom_address is None:
            yield (
                ("parameters", index, "storage"),
                f"parameter {parameter.code}: neither [memory.save] nor an eeprom_address saves"
                " it, so --save is refused.",
            )
            return


def order_of_words(data: ProfileData, tables: Tables) -> Hints:
    """Yield the first pair of registers whose order no field states."""
    for index, (parameter, row) in enumerate(
        zip(data.parameters, tables["parameters"], strict=True)
    ):
        if parameter.type.endswith("32") and "low_word_first" not in row:
            yield (
                ("parameters", index, "type"),
                f"parameter {parameter.code}: no low_word_first states which of its two words is"
                " first. Write it in [reading]; an example frame of the manual shows it.",
            )
            return


def reactions_that_trip(data: ProfileData, _: Tables) -> Hints:
    """Yield reactions with `trips = false` whose text describes a trip."""
    watch = data.communication_fault
    for place, row in enumerate(watch.reactions if watch is not None else ()):
        text = f"{row.name}. {row.does}"
        denied = re.search(r"\b(no|not|never|without)\b", text, re.I)
        if not row.trips and not denied and re.search(r"\btrips?\b", text, re.I):
            yield (
                ("communication_fault", "reactions", place),
                f"reaction {row.name!r}: its text has a trip, but trips is false.",
            )


def odd_address(data: ProfileData, _: Tables) -> Hints:
    """Yield the one address that breaks the pattern of all others over their numbers."""
    rows = [
        (index, parameter, number)
        for index, parameter in enumerate(data.parameters)
        if parameter.function == 3
        if parameter.mask == 0xFFFF and (number := _number(parameter)) is not None
    ]
    if len(rows) < LEAST_PATTERN:
        return
    for factor in (1, 10):
        offsets = Counter(parameter.address - factor * number for _, parameter, number in rows)
        offset, count = offsets.most_common(1)[0]
        if count != len(rows) - 1:
            continue
        for index, parameter, number in rows:
            right = factor * number + offset
            if parameter.address != right:
                yield (
                    ("parameters", index, "address"),
                    f"parameter {parameter.code}: its address {parameter.address} breaks the"
                    f" pattern of the other {count} rows: {right} for {parameter.number}.",
                )


def manual_numbers(data: ProfileData, _: Tables) -> Hints:
    """Yield the first of the addresses that look like numbers of the manual: 40001 for 0."""
    for function, first, needs in MANUAL_NUMBERS:
        rows = [row for row in enumerate(data.parameters) if row[1].function == function]
        # a rule of one less than the number gives 40000 for 40001
        found = [row for row in rows if -1 <= row[1].address - first < NUMBERS_OF_KIND]
        if 2 * len(found) > len(rows):
            index, parameter = found[0]
            number = _number(parameter) or 0
            if not 0 <= number - first < NUMBERS_OF_KIND:
                number = max(parameter.address, first)
            yield (
                ("parameters", index, "address"),
                f"parameter {parameter.code}: addresses from {first} up are the manual's numbers:"
                f" the wire address is the number - {first}, here {number - first}.{needs}",
            )


def reverse_by_sign(data: ProfileData, _: Tables) -> Hints:
    """Yield references with a sign if no command runs the motor in reverse."""
    ids = {order.id for chart in data.charts for order in chart.orders}
    for index, way in enumerate(data.references):
        by_sign = way.signed or way.reverse == "negative"
        if by_sign and "forward" in ids and "reverse" not in ids:
            yield (
                ("references", index),
                f"reference {way.parameter}: it has a sign, but no order runs in reverse. If a"
                " negative reference does, add an order reverse with the words of forward, and"
                ' reverse = "negative" here.',
            )


def _number(parameter: Parameter) -> int | None:
    """Return the number of the manual as a whole number; None if it is not one."""
    text = parameter.number.strip()
    if match := re.fullmatch(r"(?:16#|0[xX])([0-9A-Fa-f]+)|([0-9A-Fa-f]+)[hH]", text):
        return int(match[1] or match[2], 16)
    if re.fullmatch(r"[A-Za-z]{0,3}[0-9]{1,5}([-. ][0-9]{1,4})?", text):
        return int(re.sub(r"\D", "", text))
    return None


HINT_RULES: tuple[Callable[[ProfileData, Tables], Hints], ...] = (
    commands_by_storage,
    saved_by_nothing,
    order_of_words,
    reactions_that_trip,
    odd_address,
    manual_numbers,
    reverse_by_sign,
)
