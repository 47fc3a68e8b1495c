"""Diagram of a planned line, as text and as SVG.

The cable runs down, the tap links to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from xml.sax.saxutils import escape

from tui.drive.plain import plain

from .checks import PlanFinding, total_ohm
from .plan_file import LinePlan, PlanMaster, PlanStation

TERMINATOR_TEXTS = {"RC": "120 ohm + 1 nF", "R": "150 ohm"}
NAME_ROOM = 28
WIDTH, TOP, STEP = 900, 70, 46
_TRUNK_X, _BOX_X, _BOX_WIDTH, _BOX_HEIGHT = 90, 250, 400, 32
_INK, _FAINT, _WRONG, _MASTER = "#222222", "#666666", "#b3261e", "#1f5fa8"


@dataclass(frozen=True, slots=True)
class DrawnElement:
    """An element of the diagram, in texts."""

    label: str
    cable: str
    """Cable from the place before; empty at the first place."""
    stub: str
    """Tap link; empty for the master."""
    notes: str
    """Polarization and terminator."""
    is_master: bool
    begins_place: bool
    is_wrong: bool


def drawn_elements(plan: LinePlan, findings: list[PlanFinding]) -> list[DrawnElement]:
    """Return the elements in the order of the cable; wrong are those with an error."""
    errors = [finding for finding in findings if finding.severity == "error"]
    wrong = {address for finding in errors for address in finding.addresses}
    master_wrong = any(finding.concerns_master for finding in errors)
    rows: list[DrawnElement] = []
    for number, place in enumerate(plan.places):
        for index, item in enumerate(place):
            cable = "? m" if item.cable is None else f"{item.cable:g} m"
            rows.append(
                DrawnElement(
                    plain(_label(plan, item)),
                    cable if number and not index else "",
                    _stub(item),
                    plain(_notes(plan, item)),
                    isinstance(item, PlanMaster),
                    not index,
                    item.address in wrong if isinstance(item, PlanStation) else master_wrong,
                )
            )
    return rows


def short_name(item: PlanMaster | PlanStation) -> str:
    """Return the name of an element, cut to a length that every drawing has room for."""
    name = plain(item.name)
    return name if len(name) <= NAME_ROOM else f"{name[: NAME_ROOM - 1]}…"


def _label(plan: LinePlan, item: PlanMaster | PlanStation) -> str:
    if isinstance(item, PlanMaster):
        return "  ".join(part for part in ("Master", short_name(item), item.kind) if part)
    profile = plan.profile(item)
    kind = profile.name if profile else "other device"
    return "  ".join(part for part in (str(item.address), short_name(item), kind) if part)


def _stub(item: PlanMaster | PlanStation) -> str:
    if isinstance(item, PlanMaster):
        return ""
    return "? m" if item.stub is None else f"{item.stub:g} m"


def _notes(plan: LinePlan, item: PlanMaster | PlanStation) -> str:
    ohm = plan.ohm(item)
    parts = [f"2 x {ohm} ohm" if ohm else "", TERMINATOR_TEXTS.get(item.terminator, "")]
    if isinstance(item, PlanStation) and item.box:
        parts.append(f"box {item.box[:NAME_ROOM]}")
    return ", ".join(part for part in parts if part)


def diagram_text(plan: LinePlan, findings: list[PlanFinding]) -> list[str]:
    """Return the diagram as lines of text; `!` marks an element with an error."""
    lines: list[str] = []
    for row in drawn_elements(plan, findings):
        if row.cable:
            lines.append(f"   |  {row.cable}")
        elif lines and row.begins_place:
            lines.append("   |")
        mark = "!" if row.is_wrong else " "
        notes = f"  [{row.notes}]" if row.notes else ""
        link = "=====" if row.is_master else f"--- {row.stub:>6} ---"
        lines.append(f" {mark} +{link} {row.label}{notes}")
    return lines


def diagram_svg(plan: LinePlan, findings: list[PlanFinding]) -> str:
    """Return the diagram as SVG."""
    rows = drawn_elements(plan, findings)
    height = TOP + STEP * len(rows) + 40
    first, last = TOP + STEP // 2, TOP + STEP * len(rows) - STEP // 2
    re = total_ohm(plan)
    polarized = f"Re {re:.0f} ohm" if re else "no polarization"
    plant = plan.file
    setting = f"{plan.schematic.name}, {plant.baud} bit/s {plant.characters}, {polarized}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}"'
        f' height="{height}" font-family="sans-serif" font-size="13">',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        _svg_text(24, 30, plant.name, size=17),
        _svg_text(24, 50, setting, color=_FAINT),
        _svg_line(_TRUNK_X, first, _TRUNK_X, last, width=4),
    ]
    for number, row in enumerate(rows):
        middle = TOP + STEP * number + STEP // 2
        color = _WRONG if row.is_wrong else _MASTER if row.is_master else _INK
        parts += [
            _svg_line(_TRUNK_X, middle, _BOX_X, middle, width=4 if row.is_master else 2),
            f'<circle cx="{_TRUNK_X}" cy="{middle}" r="5" fill="{_INK}"/>',
            f'<rect x="{_BOX_X}" y="{middle - _BOX_HEIGHT // 2}" width="{_BOX_WIDTH}"'
            f' height="{_BOX_HEIGHT}" rx="4" fill="#ffffff" stroke="{color}" stroke-width="2"/>',
            _svg_text(_BOX_X + 10, middle + 5, row.label, color=color),
            _svg_text(_BOX_X + _BOX_WIDTH + 12, middle + 5, row.notes, color=_FAINT, size=12),
            _svg_text(_TRUNK_X + 60, middle - 6, row.stub, color=_FAINT, size=12),
        ]
        if row.cable:
            parts.append(_svg_text(_TRUNK_X - 60, middle - STEP // 2 + 4, row.cable, size=12))
    return "\n".join([*parts, "</svg>", ""])


def _svg_line(x1: int, y1: int, x2: int, y2: int, *, width: int) -> str:
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{_INK}" stroke-width="{width}"/>'


def _svg_text(x: int, y: int, text: str, *, color: str = _INK, size: int = 13) -> str:
    return f'<text x="{x}" y="{y}" fill="{color}" font-size="{size}">{escape(plain(text))}</text>'
