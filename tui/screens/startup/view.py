"""Start-up as lines: the steps at the left, the present one at the right; pure functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Parameter
from tui.drive.settings.writable import is_setting
from tui.drive.values import Value, is_enumeration
from tui.session.shown import Shown
from tui.session.startup.judging import (
    AS_REQUIRED,
    NOT_AT_ALL,
    OTHER_WAY,
    TURNED,
    StepRow,
    changed_codes,
)
from tui.session.startup.start_up import StartUp
from tui.session.startup.steps import KIND_ACCESS, GuideStep
from tui.widgets.drawing import cut, cut_at_word, fitted_names, rule, wrapped
from tui.widgets.palette import (
    ALARM,
    ATTENTION,
    CURSOR,
    FAINT,
    FAULT,
    LINE,
    PLAIN,
    STALE,
    STRONG,
    age_text,
)

STEP_SIGNS: Mapping[str, tuple[str, Style]] = {
    "done": ("●", PLAIN),
    "skipped": ("–", FAINT),
    "deficient": ("■", FAULT),
    "open": ("○", FAINT),
    "changed": ("◆", ALARM),
}
"""Sign of a step by its state; `changed` if a setting changed after it was done."""
STEPS_WIDTH, RESULT_WIDTH, STEP_ROOM = 24, 18, 24
"""Columns of the steps; more columns for their results on a wide screen, and the most of a name
there."""
RESULTS_FROM = 110
STEP_NUMBERS_WIDTH, STEP_NAMES_FROM = 6, 72
"""Columns of the steps on a narrow screen, which has no room for their names."""
STEP_TASK_LINES, STEP_NOTE_LINES, STEP_SOURCE_LINES = 5, 6, 3
"""Most lines of the task, the note and the source of a step."""
WRAP_LOSS = 10
"""Cells that may be lost at the end of each wrapped line."""
FOOT_RULE_FROM = 25
"""Rows from which the foot has a line of its own above it."""
STEP_ROWS_LEAST = 3
"""Rows of a step that are always shown."""
LABEL_WIDTH, VALUE_ROOM, NAME_WIDTH = 19, 14, 19
"""Columns of a usual label, the least beside a longer one, and those of a parameter's name."""
RESULT_LABELS = {
    "done": "Done: go to the next step",
    "deficient": "Deficiency ...",
    "skip": "Skip with a reason ...",
}
TURNED_LABELS = {
    AS_REQUIRED: "The motor turned as required",
    OTHER_WAY: "The motor turned the other way",
    NOT_AT_ALL: "The motor did not turn",
}
STOP_LABELS = {
    "stop": "Normal stop",
    "quick-stop": "Quick stop",
    "freewheel": "Coast stop",
    "emergency-stop": "Emergency stop",
    "dc-braking": "DC braking",
}
"""Names of the methods, by their command."""
ROWS_WITHOUT_LABEL = {*RESULT_LABELS, "turned", "parameter"}
"""Kinds of rows that have no label before a value."""
ACTION_LABELS = {
    "reference": "Reference on plate",
    "run": "Run the motor",
    "test": "Test the timeout",
    "save": "Save to EEPROM",
    "backup": "Back up",
    "report": "Write the report",
}


class StartUpView(NamedTuple):
    """The contents of the screen."""

    start_up: StartUp
    profile: Profile
    readings: Mapping[str, Shown]
    raws: Mapping[str, int]
    """Current values only."""
    staged: Mapping[str, str]
    now: float
    identity: str
    """Reference and model that the drive reports."""
    differs: Callable[[StepRow, str], bool]
    """Returns True if an entry of a nameplate differs from the drive."""
    today: str
    """Local date, as in the times of the results."""


def title_line(view: StartUpView, width: int) -> Text:
    """Return the heading: the present step and the counts."""
    start_up = view.start_up
    counts = start_up.counts()
    place = f"step {start_up.index + 1} of {len(start_up.guide.steps)}"
    done = ", ".join(f"{n} {state}" for state, n in counts.items() if n)
    return rule(f"{plain(start_up.guide.title)}: {place}", width, done)


def walk_lines(view: StartUpView, width: int, height: int) -> list[Text]:
    """Return all lines, exactly `height` of them."""
    left_width = STEPS_WIDTH + (RESULT_WIDTH if width >= RESULTS_FROM else 0)
    left_width = left_width if width >= STEP_NAMES_FROM else STEP_NUMBERS_WIDTH
    foot = foot_lines(view, width, height)
    rows = height - len(foot)
    left = _steps(view, left_width, rows)
    right = _step(view, width - left_width - 3, rows)
    lines = []
    for at in range(rows):
        line = left[at] if at < len(left) else Text(" " * left_width)
        line.append(" │ ", LINE)
        lines.append(line.append_text(right[at]) if at < len(right) else line)
    return [*lines, *foot]


def _changed(view: StartUpView, step: GuideStep) -> list[str]:
    """Return the settings of a done step that differ from those at that time."""
    return changed_codes(step, view.start_up.progress.record(step.step), view.raws)


def _state(view: StartUpView, step: GuideStep) -> str:
    record = view.start_up.progress.record(step.step)
    return "changed" if _changed(view, step) else record.state


def _steps(view: StartUpView, width: int, rows: int) -> list[Text]:
    """Return the steps around the present one."""
    start_up = view.start_up
    steps, at = start_up.guide.steps, start_up.index
    top = max(0, min(at - rows // 2, len(steps) - rows))
    room = STEPS_WIDTH - 7
    if width > STEPS_WIDTH:
        # a name is not cut while there is room for it beside the results
        room = max(room, *(min(len(plain(step.step)), STEP_ROOM) for step in steps))
    names = fitted_names(tuple(plain(step.step) for step in steps), room)
    lines = []
    for number, step in enumerate(steps[top : top + rows], start=top + 1):
        state = _state(view, step)
        sign, style = STEP_SIGNS[state]
        here = number == at + 1
        text = Text(no_wrap=True).append(" ▸" if here else "  ", ATTENTION)
        text.append(sign, style)
        name = f" {names[plain(step.step)]:<{room}}" if width > STEP_NUMBERS_WIDTH else ""
        text.append(f" {number:>2}{name}", STRONG if here else PLAIN)
        if width > STEPS_WIDTH:
            text.append(f" {cut(_result(view, step), width - 8 - room)}", FAINT)
        lines.append(text)
    return lines


def _result(view: StartUpView, step: GuideStep) -> str:
    """Return the result of a step in a few words."""
    record = view.start_up.progress.record(step.step)
    if changed := _changed(view, step):
        return f"{', '.join(changed)} changed"
    return plain(record.text or next(iter(record.entries.values()), ""))


def _step(view: StartUpView, width: int, rows: int) -> list[Text]:
    """Return the present step: access, task, its rows, note and source."""
    start_up = view.start_up
    step = start_up.step
    sign, style = STEP_SIGNS[_state(view, step)]
    head = Text(no_wrap=True).append(f"{sign} ", style)
    head.append(f"{start_up.index + 1} {plain(step.step)}", STRONG)
    top = [head, *(Text(line, style) for line in wrapped(state_text(view), width, 2))]
    task = [Text(line, PLAIN) for line in wrapped(plain(step.text), width, STEP_TASK_LINES)]
    numbered = enumerate(start_up.rows)
    body = [_row(view, row, width, number == start_up.row) for number, row in numbered]
    note = wrapped(plain(step.note), width, STEP_NOTE_LINES)
    # the task is never cut off, nor the note, which may be a warning: what the step reads and
    # writes gives way to them and to one line of the source, then the rows scroll
    for most in (2, 1, 0):
        words = [
            line
            for label, text in access(view.profile, step)
            for line in _wrapped(label, text, width, most)
        ]
        if len(top) + len(words) + len(task) + len(body) + len(note) < rows:
            break
    top += [*words, *task]
    room = max(STEP_ROWS_LEAST, rows - len(top) - len(note))
    if len(body) > room:
        first = max(0, min(start_up.row - room // 2, len(body) - room))
        body = body[first : first + room]
    below = _below(view, note, width, rows - len(top) - len(body))
    if len(top) + len(body) + len(below) + 2 <= rows:
        body = [Text(""), *body, Text("")]
    return [*top, *body, *below][:rows]


def _below(view: StartUpView, note: list[str], width: int, rows: int) -> list[Text]:
    """Return note, source and last result; in few rows the source is shortened in its middle."""
    step, past = view.start_up.step, view.start_up.record.past
    source = plain(f"Source: {step_source(view.profile, step)}")
    before = [cut_at_word(f"Before: {plain(past[-1])}", width)] if past else []
    left = max(0, min(STEP_SOURCE_LINES, rows - len(note)))
    lines = wrapped(source, width, left + 1)
    if len(lines) > left:
        cells = left * width - (left - 1) * WRAP_LOSS
        lines = wrapped(fitted_names((source,), cells)[source], width, left) if left else []
    shown = [*note, *lines, *before]
    return [Text(line, FAINT) for line in shown[: max(0, rows)]]


def state_text(view: StartUpView) -> str:
    """Return the state of the present step in words."""
    start_up = view.start_up
    record = start_up.record
    day = "" if record.time.startswith(view.today) else f" {record.time[:10]}"
    when = f"{day} {record.time[11:16]}" if record.time else ""
    changed = ", ".join(_changed(view, start_up.step))
    texts = {
        "done": f"done{when}; since then changed: {changed}" if changed else f"done{when}",
        "skipped": f"skipped{when}: {record.text}",
        "deficient": f"DEFICIENT{when}: {record.text}",
        "open": "",
    }
    return plain(texts[record.state])


def access(profile: Profile, step: GuideStep) -> list[tuple[str, str]]:
    """Return what a step reads and what it writes, with labels."""
    reads, writes = KIND_ACCESS[step.kind]
    codes = step.codes
    read = ", ".join(part for part in (reads, " ".join(codes)) if part) or "nothing"
    settings = [c for c in codes if is_setting(profile, profile[c]) and c != step.rated]
    if step.kind == "settings":
        writes = f"{writes}: {' '.join(settings)}" if settings else "nothing"
    elif settings:
        writes = f"{writes}; what you stage: {' '.join(settings)}"
    return [("Reads", read), ("Writes", writes)]


def step_source(profile: Profile, step: GuideStep) -> str:
    """Return the source of a step; the id of a manual of the profile as its title."""
    titles = {source.id: source.title for source in profile.data.sources}
    first, _, rest = step.source.partition(" ")
    named = f"{titles[first]}, {rest}" if first in titles else step.source
    return f"{named.rstrip(', ')} ({step.confidence})"


def _wrapped(label: str, text: str, width: int, most: int) -> list[Text]:
    lines = []
    for at, part in enumerate(wrapped(plain(text), width - 7, most)):
        line = Text(f"{label if not at else '':<7}", FAINT, no_wrap=True)
        lines.append(line.append(part, PLAIN))
    return lines


def _row(view: StartUpView, row: StepRow, width: int, chosen: bool) -> Text:
    """Return one row: its sign, its name, its value."""
    record = view.start_up.record
    text = Text(no_wrap=True).append("▸ " if chosen else "  ", ATTENTION)
    if row.kind in RESULT_LABELS:
        text.append(RESULT_LABELS[row.kind], PLAIN)
    elif row.kind == "turned":
        mark = "●" if record.entries.get(TURNED) == row.key else "○"
        text.append(f"{mark} {TURNED_LABELS.get(row.key, plain(row.key))}", PLAIN)
    elif row.kind == "parameter":
        text.append_text(_parameter(view, row.key, width))
    else:
        entry = record.entries.get(row.key, "")
        named = (each for each in view.start_up.rows if each.kind not in ROWS_WITHOUT_LABEL)
        labels = [_label(view, other) for other in named]
        longest = max([LABEL_WIDTH, *map(len, labels)])
        text.append(cut(_label(view, row), min(longest, width - VALUE_ROOM)), PLAIN)
        if row.kind in ("save", "report"):
            pass
        elif entry:
            text.append(f" {plain(entry)}", STRONG)
            if row.field is not None and row.field.unit:
                text.append(f" {row.field.unit}", FAINT)
            if row.kind == "plate":  # before there is an entry, a person would copy it
                text.append("  drive ", FAINT).append_text(_value(view, row.key))
            elif row.kind == "reference":
                text.append(f"  drive {view.identity or 'does not report it'}", FAINT)
            if view.differs(row, entry):
                text.append("  differs", ALARM)
        else:
            text.append(" optional" if not row.required else " .....", FAINT)
    if chosen:
        text.append(" " * max(0, width - text.cell_len))
        text.stylize(CURSOR)
    return text


def _label(view: StartUpView, row: StepRow) -> str:
    if row.kind == "plate":
        return f"{row.key} on nameplate"
    if row.kind == "speed":
        return f"At {row.key}"
    if row.kind == "stop":
        return STOP_LABELS.get(row.key, plain(row.key))
    return plain(ACTION_LABELS.get(row.kind, row.key))


def _parameter(view: StartUpView, code: str, width: int) -> Text:
    parameter = view.profile[code]
    name, mark = parameter.name, "" if is_verified(parameter) else "?"
    text = Text().append(f"{code + mark:<6}", STRONG)
    text.append(f" {cut(name, max(NAME_WIDTH, width - 9 - 2 * VALUE_ROOM))} ", PLAIN)
    text.append_text(_value(view, code))
    if code in view.staged:
        text.append(f"  staged {view.staged[code]}", ATTENTION)
    return text


def _value(view: StartUpView, code: str) -> Text:
    reading = view.readings.get(code)
    none = Text("-----", FAINT)
    if reading is None:
        return none
    if reading.absent:
        return Text("not in this drive", FAINT)
    parameter = view.profile[code]
    return reading.drawn(
        view.now,
        current=lambda value: Text(_value_text(parameter, value), STRONG),
        old=lambda value, age: Text(f"{_value_text(parameter, value)}, {age_text(age)} old", STALE),
        missing=none,
    )


def _value_text(parameter: Parameter, value: Value) -> str:
    """Return a value; a number as raw if no document has its scale."""
    is_plain = not (value.unit or parameter.bits) and parameter.scale == "1"
    unknown = is_plain and not is_verified(parameter) and not is_enumeration(parameter)
    return f"raw {value.display}" if unknown else value.display


def foot_lines(view: StartUpView, width: int, height: int) -> list[Text]:
    """Return what is not of one step: trouble with the disk, and what has changed."""
    start_up = view.start_up
    lines = []
    for text, style in ((start_up.trouble, FAULT), (start_up.notice, ALARM)):
        lines += [Text(line, style) for line in wrapped(plain(text), width, 2)]
    if start_up.changes.texts:
        count = len(start_up.changes.texts)
        text = f" Changed while nothing was read, {count}: {', '.join(start_up.changes.texts)}"
        lines.append(Text(cut_at_word(text, width).rstrip(), ALARM))
    elif start_up.resumed:
        begun = start_up.progress.begun[:16].replace("T", " ")
        how = "then type begin" if width >= STEP_NAMES_FROM else "begin"
        lines.append(Text(f" Begun {begun}. For another drive: Ctrl+P, {how}.", FAINT))
    return [rule("", width), *lines] if lines and height >= FOOT_RULE_FROM else lines
