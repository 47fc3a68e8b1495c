"""Blocks and scanner as lines: the slots, the details of one, the cost, the frame."""

from __future__ import annotations

from collections.abc import Sequence

from rich.style import Style
from rich.text import Text

from tui.drive.blocks.assignment import UNUSED, Assignment, describe, slot_target
from tui.drive.blocks.user_words import UserWord, UserWords
from tui.drive.blocks.wire_cost import Saving, Stretch, block_request, microseconds, together
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Block, Parameter
from tui.drive.sentences import counted
from tui.drive.values import NOT_AVAILABLE
from tui.session.blocks.editor import BlockEditor
from tui.session.blocks.mapping import BlockView, Force, Slot, wire_timing
from tui.session.read.proof import SlotMatch
from tui.widgets.drawing import cut, fitted_names, rule, short, wrapped
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, FAULT, PLAIN, STRONG
from tui.wire.frames import hex_text

BOTH = 50
"""Columns from which a table also shows the directly read value."""
INDENT = 6
"""Cells before the second line of a slot."""
NARROW_SLOT = 72
"""Columns below which the unit of a slot's values is omitted: they have it."""
WIDE_SLOTS = 110
"""Columns from which each slot takes two lines."""
VERDICT_STYLES = {
    SlotMatch.SAME: FAINT,
    SlotMatch.MOVING: FAINT,
    SlotMatch.DIFFERS: FAULT,
    SlotMatch.CHANGED: ALARM,
    SlotMatch.NONE: ALARM,
    SlotMatch.UNUSED: FAINT,
    SlotMatch.UNREAD: FAINT,
}
MATCH_WORDS = {
    SlotMatch.CHANGED: "changed",
    SlotMatch.NONE: "no value",
    SlotMatch.UNREAD: "-",
    SlotMatch.UNUSED: "",
}
"""Results of the comparison, in eight characters at most."""
PENDING = "Pending: takes effect after the drive's next reset or power-up."


def table_lines(
    block_editor: BlockEditor, block: Block, width: int, at: int | None, *, double: bool
) -> list[Text]:
    """The slots of one block under its heading; `at` is the cursor's slot, or None."""
    view = block_editor.views.get(block.id)
    plan = block_editor.proposals.plans.get(block.id)
    through = "through the block" if block.direction == "read" else "last written"
    right = "staged" if plan else f"{through} · direct" if width >= BOTH else ""
    slots = view.slots if view else [Slot(code, None) for code in block.slots]
    raws = plan.raws if plan else [None] * len(slots)
    lines = [
        _slot_line(block_editor, block, slot, raw, width, chosen=place == at)
        for place, (slot, raw) in enumerate(zip(slots, raws, strict=True))
    ]
    if double:
        held = [slot.raw if raw is None else raw for slot, raw in zip(slots, raws, strict=True)]
        below = _second_lines(block_editor.session.profile, block, held, width)
        lines = [line for pair in zip(lines, below, strict=True) for line in pair]
    return [rule(block.name, width, right), *lines]


def _slot_line(
    block_editor: BlockEditor,
    block: Block,
    slot: Slot,
    proposed: int | None,
    width: int,
    *,
    chosen: bool,
) -> Text:
    profile = block_editor.session.profile
    text = Text(no_wrap=True, style=CURSOR if chosen else Style())
    text.append("▸" if chosen else " ", STRONG)
    text.append(f"{slot.code:<5}", STRONG if chosen else PLAIN)
    used = slot.raw not in (0, None)
    stands = describe(profile, block, slot.raw)
    if used and slot.parameter is None:
        stands = f"{slot.raw}?"
    cells = 9 if width < BOTH else 12
    text.append(short(stands, cells), PLAIN if used else FAINT)
    spare = cells - len(short(stands, cells))
    changed = proposed is not None and proposed != slot.raw
    if changed:
        text.append(" " * spare)
        text.append(cut(f" → {describe(profile, block, proposed)}", 12), ATTENTION)
        return _filled(text, width)  # the value read is that of the old mapping
    room = width - text.cell_len - spare
    both = width >= BOTH
    verdict, style = _verdict(block, slot)
    value_room = max(4, (room - 9) // 2 if both else room - 9)
    values = [slot.text, slot.direct_text] if both else [slot.text]
    if block.direction == "write" and not both:
        values, verdict = [slot.direct_text], verdict or "direct"
    for place, value in enumerate(values):
        # a long value uses the cells that its code leaves
        least = value_room if place else value_room + spare
        shown = short(value, max(4, least - 1)) if used else ""
        text.append(f"{shown:>{least}}", FAINT if place else PLAIN)
    text.append(f" {verdict if used else '':<8}", style)
    return _filled(text, width)


def _verdict(block: Block, slot: Slot) -> tuple[str, Style]:
    """The result of the comparison, in few characters; outputs have none."""
    if slot.force is Force.PENDING:
        return "pending", ALARM
    if block.direction == "write" and slot.verdict not in (SlotMatch.CHANGED, SlotMatch.NONE):
        return "", FAINT
    return MATCH_WORDS.get(slot.verdict, str(slot.verdict)), VERDICT_STYLES[slot.verdict]


def _filled(text: Text, width: int) -> Text:
    text.truncate(width)
    text.append(" " * max(0, width - text.cell_len))
    return text


def _second_lines(
    profile: Profile, block: Block, raws: Sequence[int | None], width: int
) -> list[Text]:
    """The three notations and the name, dim, under each slot."""
    targets = [slot_target(profile, block, raw) if raw else None for raw in raws]
    known = [parameter for parameter in targets if parameter is not None]
    longest = max((len(notation_text(parameter)) for parameter in known), default=0)
    names = fitted_names(tuple(p.name for p in known), max(8, width - INDENT - longest - 2))
    lines = []
    for parameter in targets:
        text = Text(" " * INDENT, no_wrap=True)
        if parameter is not None:
            text.append(f"{notation_text(parameter)}  {names[parameter.name]}", FAINT)
        lines.append(text)
    return lines


def notation_text(parameter: Parameter) -> str:
    """The manual's number, the wire address in hexadecimal and in decimal."""
    hexadecimal = f"16#{parameter.address:04X}"
    number = "" if parameter.number == hexadecimal else f"{parameter.number}  "
    return f"{number}{hexadecimal}  {parameter.address}"


def slot_lines(block_editor: BlockEditor, block: Block, place: int, width: int) -> list[Text]:
    """The slot under the cursor, in four lines."""
    view, plan = block_editor.views.get(block.id), block_editor.proposals.proposed(block)
    code = block.slots[place]
    if view is None or plan is None:
        trouble = (view.trouble if view else "") or block_editor.trouble or "reading the slots"
        return [
            Text(f" {trouble}", ALARM if view or block_editor.trouble else FAINT),
            *[Text("")] * 3,
        ]
    slot, raw = view.slots[place], plan.raws[place]
    parameter = slot_target(block_editor.session.profile, block, raw)
    own = block_editor.session.profile[code]
    first = Text().append(f" {code}", STRONG)
    first.append(f"  {notation_text(own)}", FAINT)
    first.append("  " if raw == UNUSED else "  mapped to ", FAINT)
    if parameter is None:
        first.append(describe(block_editor.session.profile, block, raw), PLAIN)
        return [first, *_remarks(block_editor, view, slot, code, width), *[Text("")] * 3][:4]
    first.append(f"{parameter.code}{'' if is_verified(parameter) else '?'}", STRONG)
    room = max(8, width - first.cell_len - 2)
    first.append(f"  {fitted_names((parameter.name,), room)[parameter.name]}", PLAIN)
    second = Text(f" {notation_text(parameter)}", PLAIN)
    second.append(f"   unit {parameter.unit or '-'}" if width >= NARROW_SLOT else "", FAINT)
    if raw == slot.raw:
        through = "last written" if block.direction == "write" else "through the block"
        through = through if width >= NARROW_SLOT else through.split()[-1]
        second.append(f"   {through} ", FAINT)
        second.append(slot.text, STRONG)
        second.append("   direct ", FAINT)
        second.append(slot.direct_text, PLAIN)
    for line in (first, second):
        line.truncate(width, overflow="ellipsis")
    rest = _remarks(block_editor, view, slot, code, width)
    return [first, second, *rest, Text(""), Text("")][:4]


def _remarks(
    block_editor: BlockEditor, view: BlockView, slot: Slot, code: str, width: int
) -> list[Text]:
    """Comparison, activation and problems of a slot, each as a sentence."""
    found = [(p.text, ALARM) for p in block_editor.proposals.problems(view.block) if p.slot == code]
    if view.block.effective == "after-reset" and slot.raw:
        found.append((_force_text(slot), ALARM if slot.force is Force.PENDING else FAINT))
    elif view.block.direction == "read" and slot.verdict not in (
        SlotMatch.UNUSED,
        SlotMatch.UNREAD,
    ):
        found.append((f"Compared with direct reads: {slot.verdict}.", VERDICT_STYLES[slot.verdict]))
    if view.trouble:
        found.append((view.trouble, ALARM if view.block.direction == "read" else FAINT))
    text = [(line, style) for reported, style in found for line in wrapped(reported, width - 2, 2)]
    return [Text(f" {line}", style) for line, style in text[:2]]


def _force_text(slot: Slot) -> str:
    """Return if a slot of an indirect block is active, and the evidence."""
    if slot.force is Force.ACTIVE:
        return "Active: only this parameter can have returned that value."
    if slot.force is Force.PENDING:
        until = f" Until then it returns {slot.returned_code}." if slot.returned_code else ""
        return f"{PENDING}{until}"
    return "Configured. The drive does not report if this mapping is active."


def cost_lines(
    block_editor: BlockEditor, block: Block, saving: Saving | None, width: int
) -> list[Text]:
    """Return the cost of a monitoring cycle before and after, and the frame of the selected block.

    Always four lines.
    """
    profile = block_editor.session.profile
    inputs, outputs = together(profile, *_plans(block_editor), block.direction)
    lines = [rule("On the wire", width)]
    text = Text(" ", no_wrap=True)
    if saving is None:
        text.append("not known: slots not read yet", FAINT)
    else:
        forms = [_cycle_text(block_editor, saving, at) for at in range(len(CYCLE_FORMS))]
        text = next((form for form in forms if form.cell_len <= width), forms[-1])
        whole = microseconds(profile, wire_timing(block_editor.session), inputs, outputs)
        reported = f"   one exchange {_ms(whole)}"
        if whole and text.cell_len + len(reported) <= width:
            text.append(reported, FAINT)
    text.truncate(width, overflow="ellipsis")
    sent = block_request(
        profile, block_editor.session.device, inputs, outputs, _output_words(block_editor)
    )
    hexes = wrapped(hex_text(sent) or "none: no slot is used", width - 8, 2)
    frames = [
        Text(f" {'frame' if not line else '':<6}{hexes[line] if line < len(hexes) else ''}", PLAIN)
        for line in range(2)
    ]
    return [*lines, text, *frames]


CYCLE_FORMS = (
    ("monitoring cycle", True, True),
    ("monitoring cycle", False, True),
    ("monitoring cycle", False, False),
    ("cycle", False, False),
)
"""Name of the cycle, and if the requests before and after are shown: the shorter, the later."""


def _cycle_text(block_editor: BlockEditor, saving: Saving, form: int) -> Text:
    """Return the time of a monitoring cycle now and with the staged slots."""
    name, is_before, is_after = CYCLE_FORMS[form]
    text = Text(f" {name} {_ms(saving.before.microseconds)}", PLAIN, no_wrap=True)
    if is_before or (is_after and not block_editor.proposals.plans):
        text.append(f" {_requests(saving.before.requests)}", FAINT)
    if _waits_for_a_reset(block_editor):
        text.append(" · after a reset", ALARM)
    if block_editor.proposals.plans:
        text.append("  → staged ", FAINT)
        text.append(f"{_ms(saving.after.microseconds)}", STRONG)
        text.append(f" {_requests(saving.after.requests)}" if is_after else "", FAINT)
        text.append(f"  ({_ms(_shown_change(saving), sign=True)})", ATTENTION)
    return text


def _shown_change(saving: Saving) -> int:
    """Return the microseconds between the two costs as they are shown, in tenths of 1 ms."""
    before, after = (float(f"{c.microseconds / 1000:.1f}") for c in (saving.before, saving.after))
    return round((after - before) * 1000)


def _requests(count: int) -> str:
    return counted(count, "in 1 request", "in {count} requests")


def _waits_for_a_reset(block_editor: BlockEditor) -> bool:
    """Return True if slots take effect only after a reset; the cost then applies after it."""
    views = block_editor.views.values()
    return any(slot.force is Force.PENDING for view in views for slot in view.slots)


def _output_words(block_editor: BlockEditor) -> list[int]:
    """Return the output values for the frame; 0 if unknown."""
    for block in block_editor.proposals.blocks:
        view = block_editor.views.get(block.id)
        if block.direction == "write" and view is not None:
            held = [slot.direct.raw if slot.direct else None for slot in view.slots]
            return [(raw or 0) & 0xFFFF for raw in held]
    return []


def _plans(block_editor: BlockEditor) -> tuple[Assignment | None, Assignment | None]:
    found = {
        block.direction: block_editor.proposals.proposed(block)
        for block in block_editor.proposals.blocks
    }
    return found.get("read"), found.get("write")


def _ms(microseconds: int, *, sign: bool = False) -> str:
    number = microseconds / 1000
    return f"{number:+.1f} ms" if sign else f"{number:.1f} ms"


def user_word_lines(block_editor: BlockEditor, words: UserWords, width: int) -> list[Text]:
    """The four user words, in two lines with their heading."""
    text = Text(" ", no_wrap=True)
    room = max(10, (width - 2) // max(1, len(words)))
    for word, raw in zip(words, block_editor.word_raws, strict=False):
        parameter = block_editor.session.profile.at(word.address) if word.address else None
        name = parameter.code if parameter else f"W{word.address}" if word.address else "none"
        shown = word.text(raw)
        if len(name) + len(shown) >= room:  # bits, in a narrow terminal
            shown = UserWord(word.address).text(raw)
        text.append(f"{name} ", FAINT)
        style = FAINT if shown == NOT_AVAILABLE else PLAIN
        text.append(f"{shown:<{max(0, room - len(name) - 1)}}", style)
    text.truncate(width, overflow="ellipsis")
    return [rule("User words", width), text]


def stretch_lines(
    block_editor: BlockEditor, found: Sequence[Stretch], width: int, room: int
) -> list[Text]:
    """For a family without blocks: the adjacent words that are best read in one request."""
    lines: list[Text] = []
    for stretch in found:
        request = stretch.request
        count, address = f" {request.count:>2} words", request.address
        head = Text(f"{count} from {address} (16#{address:04X})  ", PLAIN, no_wrap=True)
        head.stylize(STRONG, 0, len(count))
        head.append(_ms(stretch.cost), STRONG)
        head.append(f"  one by one {_ms(stretch.alone)}, saves {_ms(stretch.saves)}", FAINT)
        lines.append(head)
        lines += [Text(f"    {t}", PLAIN) for t in wrapped(", ".join(stretch.codes), width - 5, 2)]
        if stretch.beside:
            text = f"also read: {', '.join(stretch.beside)}"
            lines += [Text(f"    {t}", FAINT) for t in wrapped(text, width - 5, 1)]
    if not found:
        lines = [Text(" No two values of the monitoring set are close enough together.", FAINT)]
    return lines[:room]
