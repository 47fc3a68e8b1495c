"""Signal paths as a drawing: sources at the left, switches, the motor at the right.

The live path is drawn bright and with heavy lines, so that it is seen without color too. A path
that is not known has no bright part.
"""

from __future__ import annotations

from dataclasses import dataclass

from rich.style import Style
from rich.text import Text

from tui.drive.sentences import all_of
from tui.drive.signal_path import PathState, Signal, is_certain
from tui.session.control_paths import ControlPaths, PathSourceText
from tui.widgets.drawing import cut, short, wrapped
from tui.widgets.palette import ALARM, FAINT, LINE, PLAIN, STRONG, TITLE

SIGNAL_TITLES: dict[Signal, str] = {"reference": "Reference", "command": "Command"}
HINT_ROWS = 3
"""Rows of one sentence on a path, at most."""
LEAST_WIDTH, LEAST_HEIGHT = 80, 24
"""Size of the terminal from which the paths are drawn; below it they are written in words."""
WIDEST_DRAWING = 110
"""Cells of the drawing at most: longer wires say no more."""
MOTOR_WIDTH = 10
"""Cells of the motor with the wire to it."""
LABEL, VALUE, WIDE_LABEL, WIDE_VALUE, WIDE_FROM = 16, 8, 24, 14, 100
"""Cells of a source and its value, in a narrow and in a wide terminal."""
DRAWING_ROWS = 8
"""Rows of the drawing."""


class Canvas:
    """Cells with styles, filled in any order; text beyond an edge is dropped."""

    def __init__(self, width: int, height: int) -> None:
        self.width = width
        self._cells: list[list[tuple[str, Style]]] = [[(" ", PLAIN)] * width for _ in range(height)]

    def put(self, row: int, column: int, text: str, style: Style = PLAIN) -> None:
        """Write a text at a place."""
        for at, character in enumerate(text, column):
            if 0 <= at < self.width:
                self._cells[row][at] = (character, style)

    def lines(self) -> list[Text]:
        """Return the rows as lines, with one span for each run of a style."""
        found = []
        for cells in self._cells:
            line = Text(no_wrap=True)
            run, style = "", PLAIN
            for character, own in cells:
                if own is not style:
                    line.append(run, style)
                    run, style = "", own
                run += character
            line.append(run.rstrip() if style in (PLAIN, FAINT) else run, style)
            found.append(line)
        return found


@dataclass(frozen=True, slots=True)
class PathColumns:
    """PathColumns of the drawing."""

    label: int
    value: int
    contact: int
    """Contacts of the first switch."""
    stages: tuple[int, ...]
    """Places of the switches on their wire; the first is the pivot of the first switch."""
    join: int
    """Wire from both signals to the motor."""


@dataclass(frozen=True, slots=True)
class PathTexts:
    """Texts of a path: of its sources, the first one of the path included, and its switches."""

    sources: tuple[PathSourceText, ...]
    heads: tuple[str, ...]

    @property
    def needs(self) -> list[int]:
        """Cells of each switch: its head, or the source beside it, and a blank."""
        sides = ["", *(f"○ {side_text(source)}" for source in self.sources[2:])]
        return [
            max(len(head), len(side)) + 1 for head, side in zip(self.heads, sides, strict=False)
        ]


def path_texts(paths: ControlPaths, state: PathState) -> PathTexts:
    """Return the texts of a path as it is."""
    path = state.path
    sources = (path.first, *(switch.other for switch in path.switches))
    heads = (
        f"{switch.name} {paths.switch_state(state, index)}".rstrip()
        for index, switch in enumerate(path.switches)
    )
    return PathTexts(tuple(paths.source_text(source) for source in sources), tuple(heads))


def columns_of(needs: list[int], width: int) -> PathColumns:
    """Return the columns for a path whose switches need these cells."""
    label, value = (WIDE_LABEL, WIDE_VALUE) if width >= WIDE_FROM else (LABEL, VALUE)
    contact = 2 + label + value + 3
    join = width - MOTOR_WIDTH
    first = contact + 2
    room = join - first
    needs = [*needs[:-1], needs[-1] - 1] if needs else []  # at the wire to the motor no blank
    if sum(needs) > room:
        needs = [room // len(needs)] * len(needs)
    spare = (room - sum(needs)) // max(1, len(needs))
    places, at = [], first
    for need in needs:
        places.append(at)
        at += need + spare
    return PathColumns(label, value, contact, tuple(places), join)


def draw_path(
    canvas: Canvas, top: int, state: PathState, texts: PathTexts, columns: PathColumns
) -> None:
    """Draw one path in four rows: title, first source, wire, other sources."""
    path, live = state.path, state.live is not None
    heads, sources = texts.heads, texts.sources
    canvas.put(top, 1, SIGNAL_TITLES[path.carries].upper(), TITLE)
    if state.unknown:
        canvas.put(top, columns.contact + 2, "not known", ALARM)
    elif not is_certain(state):
        canvas.put(top, columns.contact + 2, UNCERTAIN, FAINT)
    for row, source in ((top + 1, 0), (top + 3, 1))[: len(sources)]:
        on = live and state.enters == source - 1
        draw_source(canvas, row, columns, sources[source], on=on)
    wire = top + 2
    for index, (column, head) in enumerate(zip(columns.stages, heads, strict=True)):
        name = path.switches[index].name
        end = columns.stages[index + 1] if index + 1 < len(heads) else columns.join
        head = short(head, end - column - 1)
        canvas.put(top + 1, column, head, PLAIN)
        canvas.put(top + 1, column, head[: len(name)], STRONG if live else PLAIN)
        on = live and state.enters <= index
        draw_wire(canvas, wire, column, end, on=on)
        if index == 0:
            draw_blade(canvas, wire, columns.contact, state)
        else:
            draw_side(canvas, wire, column, end, state, index, sources[index + 1])
    if not heads:
        draw_wire(canvas, wire, columns.contact + 1, columns.join, on=live)


def side_text(source: PathSourceText) -> str:
    """Return a source beside a switch: its parameter and what it selects, or its name."""
    return f"{source.label} {source.name}".rstrip()


def draw_source(
    canvas: Canvas, row: int, columns: PathColumns, source: PathSourceText, *, on: bool
) -> None:
    """Draw a source with its value and its contact; bright if it is the active one."""
    text = short(side_text(source), columns.label)
    canvas.put(row, 2, text, FAINT)
    canvas.put(row, 2, text[: len(source.label)], STRONG if on else PLAIN)
    if on:
        canvas.put(row, 2, text, STRONG)
    value = f"{short(source.value, columns.value):>{columns.value}}"
    canvas.put(row, 2 + columns.label, value, PLAIN if on else FAINT)
    start = 3 + columns.label + columns.value
    draw_wire(canvas, row, start, columns.contact, on=on)
    canvas.put(row, columns.contact, "●" if on else "○", STRONG if on else LINE)


def draw_wire(canvas: Canvas, row: int, start: int, end: int, *, on: bool) -> None:
    """Draw a wire from one column up to another."""
    canvas.put(row, start, ("━" if on else "─") * (end - start), STRONG if on else LINE)


def draw_blade(canvas: Canvas, row: int, contact: int, state: PathState) -> None:
    """Draw the first switch between its contacts and its wire."""
    position, pivot = state.positions[0], contact + 2
    if position is None:
        canvas.put(row, contact + 1, "?○", ALARM)
        return
    on = state.live is not None and state.enters <= 0
    style = STRONG if on else LINE
    canvas.put(row, contact + 1, "╱" if position.contact else "╲", style)
    canvas.put(row, pivot, "●" if on else "○", style)


def draw_side(
    canvas: Canvas,
    row: int,
    column: int,
    end: int,
    state: PathState,
    index: int,
    source: PathSourceText,
) -> None:
    """Draw a later switch: on its wire, or with the source beside it that it connects."""
    position, live = state.positions[index], state.live is not None
    text = short(side_text(source), end - column - 2)
    if position is None:
        canvas.put(row, column, "?", ALARM)
        canvas.put(row + 1, column, f"○ {text}", FAINT)
    elif position.contact:
        on = live and state.enters == index
        style = STRONG if on else PLAIN
        canvas.put(row, column, "┏" if on else "┌", style)
        canvas.put(row + 1, column, f"{'┗' if on else '└'} {text}", style)
    else:
        on = live and state.enters < index
        canvas.put(row, column, "●" if on else "○", STRONG if on else LINE)
        canvas.put(row + 1, column, f"○ {text}", FAINT)


def drawing(paths: ControlPaths, speed: str, style: Style, width: int) -> list[Text]:
    """Return both paths with the motor; `speed` is its frequency in Hz, in `style`."""
    canvas = Canvas(min(width, WIDEST_DRAWING), DRAWING_ROWS)
    join = canvas.width - MOTOR_WIDTH
    states = {carries: paths.state(carries) for carries in SIGNAL_TITLES}
    texts = {c: path_texts(paths, state) for c, state in states.items() if state is not None}
    needs = {carries: own.needs for carries, own in texts.items()}
    if len({len(own) for own in needs.values()}) == 1:
        # switches of both paths below one another
        shared = [max(each) for each in zip(*needs.values(), strict=True)]
        needs = dict.fromkeys(needs, shared)
    lit = []
    for (carries, title), (top, below, bright, thin) in zip(
        SIGNAL_TITLES.items(), CORNERS, strict=True
    ):
        if (state := states[carries]) is None:
            canvas.put(top, 1, title.upper(), TITLE)
            canvas.put(top + 1, 2, NOT_DESCRIBED, FAINT)
            continue
        columns = columns_of(needs[carries], canvas.width)
        draw_path(canvas, top, state, texts[carries], columns)
        on = state.live is not None
        lit.append(on)
        canvas.put(top + 2, join, bright if on else thin, STRONG if on else LINE)
        canvas.put(below, join, "┃" if on else "│", STRONG if on else LINE)
    on = bool(lit) and all(lit)
    canvas.put(4, join, "┣━" if on else "├─", STRONG if on else LINE)
    for row, text in ((3, "╭──────╮"), (4, "│      │"), (5, "╰──────╯")):
        canvas.put(row, join + 2, text, LINE)
    canvas.put(4, join + 3, f"{short(speed, 6):^6}", style)
    canvas.put(6, join + 2, "motor Hz" if speed else " motor", FAINT)
    return canvas.lines()


CORNERS = ((0, 3, "┓", "┐"), (4, 5, "┛", "┘"))
"""Of each path: its first row, the row of its wire to the motor, and its bright and thin corner."""
UNCERTAIN = "? from a sister family"
NOT_DESCRIBED = "No manual of this family describes this path."


def written_paths(paths: ControlPaths, width: int) -> list[Text]:
    """Return both paths in words, for a small terminal: the live source, and the switches."""
    lines = []
    for carries, title in SIGNAL_TITLES.items():
        state = paths.state(carries)
        line = Text(f" {title:<10}", FAINT, no_wrap=True)
        if state is None:
            lines.append(line.append("not described by a manual", FAINT))
            continue
        if state.live is None:
            line.append("not known", ALARM)
        else:
            source = paths.source_text(state.live)
            text = f"{side_text(source)}  {source.value}".rstrip()
            line.append(short(text, width - 12), STRONG)
        heads = path_texts(paths, state).heads
        lines += [line, Text(cut(f"   {' · '.join(heads)}", width).rstrip(), PLAIN, no_wrap=True)]
    return lines


def hints(paths: ControlPaths, width: int) -> list[Text]:
    """Return what to change so that this line commands, and the setting of the paths."""
    found: dict[str, list[str]] = {}
    unknown: dict[str, list[str]] = {}
    notes = []
    for carries, title in SIGNAL_TITLES.items():
        state = paths.state(carries)
        if state is None:
            continue
        if state.unknown:
            unknown.setdefault(state.unknown, []).append(title)
        elif way := paths.way_text(state):
            found.setdefault(way, []).append(title)
        elif state.path.note:
            notes.append(state.path.note)
    lines = []
    for way, titles in found.items():
        text = f"{all_of(titles).capitalize()} by Modbus: {way}."
        lines += [Text(f"  {line}", PLAIN) for line in wrapped(text, width - 4, HINT_ROWS)]
    for why, titles in unknown.items():
        named = all_of([f"the {title.lower()}" for title in titles])
        text = f"The source of {named} is not known: {why}."
        lines += [Text(f"  {line}", ALARM) for line in wrapped(text, width - 4, HINT_ROWS)]
    for note in dict.fromkeys(notes):
        lines += [Text(f"  {line}", FAINT) for line in wrapped(note, width - 4, HINT_ROWS)]
    return lines
