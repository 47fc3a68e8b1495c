"""Values for the outputs of a block or scanner, and the consequences of writing them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from tui.drive.blocks.assignment import Assignment, MappingError, describe, slot_target
from tui.drive.blocks.wire_cost import block_request, reach, together
from tui.drive.errors import ValueRefused
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.sentences import all_of
from tui.drive.shown import raw_of_text, shown_text, typed_text
from tui.drive.values import to_words
from tui.wire.frames import hex_text

REFERENCE_QUANTITIES = frozenset({"command_frequency", "command_speed"})


@dataclass(frozen=True, slots=True)
class ConfirmedWrite:
    """Values for outputs as a person has agreed to them, with the slots that were seen."""

    outputs: Assignment
    inputs: Assignment | None
    wanted: Mapping[str, int]
    """Raw values by code."""
    follows: str
    """Frames and their consequences, one sentence per line."""


def output_codes(profile: Profile, outputs: Assignment) -> dict[str, Parameter]:
    """Return the parameters of the output slots by code."""
    found = (slot_target(profile, outputs.block, raw) for raw in outputs.raws)
    return {parameter.code: parameter for parameter in found if parameter is not None}


def example(
    profile: Profile,
    outputs: Assignment,
    raws: Mapping[str, int],
    absent: Collection[str],
) -> str:
    """Return an example text with the last values of the first two of these outputs.

    An output that was not read is left out; empty if none was.
    """
    first = list(output_codes(profile, outputs).values())[:2]
    return " ".join(
        f"{p.code}={typed_text(profile, p, raws[p.code], raws, absent)}"
        for p in first
        if p.code in raws
    )


def intended(
    profile: Profile,
    device: int,
    outputs: Assignment,
    inputs: Assignment | None,
    raws: Mapping[str, int],
    absent: Collection[str],
    text: str,
) -> ConfirmedWrite:
    """Parse a text like `LFRD=1500 ACC=5.0`.

    `raws` are known raw values, for scales; `absent` are codes that the drive lacks. Raises
    ValueRefused and UnknownParameter with what is wrong.
    """
    possible = output_codes(profile, outputs)
    wanted: dict[str, int] = {}
    for part in text.split():
        code, sign, value = part.replace(",", ".").partition("=")
        parameter = profile.find(code)
        if not sign or parameter.code not in possible:
            raise ValueRefused(
                f"{part!r} is not a value of an output. Use CODE=VALUE with one of"
                f" {', '.join(possible)}."
            )
        wanted[parameter.code] = raw_of_text(profile, parameter, value, raws, absent).raw
    if not wanted:
        raise ValueRefused(f"Use CODE=VALUE with one of {', '.join(possible)}.")
    places = reach(profile, outputs, wanted)
    lines = [*_lines(profile, outputs, places, wanted, raws, absent)]
    inputs, _ = together(profile, inputs, outputs, "write")
    carried = [code for code in _codes(profile, outputs, places) if code not in wanted]
    if unread := [code for code in carried if code not in raws]:
        lines.append(f"Frame: not shown. Not read yet: {', '.join(unread)}.")
    else:
        words = [_word(profile, outputs, place, {**raws, **wanted}) for place in places]
        frame = hex_text(block_request(profile, device, inputs, outputs, words, places))
        held = values_text(profile, {code: raws[code] for code in carried}, raws, absent)
        lines.append(f"Frame with {held}: {frame}" if held else f"Frame: {frame}")
    return ConfirmedWrite(outputs, inputs, wanted, "\n".join(lines))


def _codes(profile: Profile, outputs: Assignment, places: range) -> list[str]:
    """Return the codes of the parameters in these places."""
    found = (slot_target(profile, outputs.block, outputs.raws[place]) for place in places)
    return [parameter.code for parameter in found if parameter is not None]


def refuse_pending(outputs: Assignment, waits: Mapping[str, int]) -> None:
    """Raise MappingError if slots take effect only after a reset that was not seen yet.

    `waits` are raw values by slot that were written since.
    """
    if found := [slot for slot, raw in outputs.slots.items() if waits.get(slot) == raw]:
        raise MappingError(f"Not in effect yet: {', '.join(found)}. Reset the drive first.")


def values_text(
    profile: Profile,
    values: Mapping[str, int],
    raws: Mapping[str, int],
    absent: Collection[str],
) -> str:
    """Return codes with their values in one line."""
    return ", ".join(
        f"{c} {shown_text(profile, profile[c], raw, raws, absent)}" for c, raw in values.items()
    )


def _lines(
    profile: Profile,
    outputs: Assignment,
    places: range,
    wanted: Mapping[str, int],
    raws: Mapping[str, int],
    absent: Collection[str],
) -> list[str]:
    block = outputs.block
    lines, beside = [], []
    for place in places:
        code = describe(profile, block, outputs.raws[place])
        if code in wanted:
            value = shown_text(profile, profile[code], wanted[code], raws, absent)
            lines.append(f"{block.slots[place]}: {code} {value}")
        else:
            beside.append(code)
    if beside:
        lines.append(f"Also written, with the value that is read just before: {', '.join(beside)}.")
    if block.effective == "after-reset":
        lines.append(
            f"The mapping that {block.name} has had since the last reset cannot be"
            f" read. Continue only if {all_of(block.slots)} were set before the drive was"
            " last reset or switched on."
        )
    if any(_moves(profile, describe(profile, block, outputs.raws[place])) for place in places):
        lines.append("A command word or reference can move the motor.")
    return lines


def _moves(profile: Profile, code: str) -> bool:
    """Return True if a word is a command or a reference of the line."""
    commands = {chart.command for chart in profile.data.charts}
    return code in commands or profile[code].quantity in REFERENCE_QUANTITIES


def _word(profile: Profile, outputs: Assignment, place: int, raws: Mapping[str, int]) -> int:
    """Return the word for a place; 0 for an unused one."""
    parameter = slot_target(profile, outputs.block, outputs.raws[place])
    return 0 if parameter is None else to_words(parameter, raws[parameter.code])[0]
