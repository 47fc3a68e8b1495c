"""Lines on paper: limits of the manuals, times, parts, the diagram, and faults of a file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.sources import ROOT
from tui.drive.profile import library
from tui.drive.read_plan import WireTiming, plan_reads
from tui.session.line_plan.checks import PlanFinding, best_master_ohm, plan_findings, total_ohm
from tui.session.line_plan.drawing import diagram_svg, diagram_text
from tui.session.line_plan.from_scan import NotAScan, plant_of_scan
from tui.session.line_plan.parts import parts_list
from tui.session.line_plan.plan_file import LinePlan, PlantFileError, plant_schema, read_plant
from tui.session.line_plan.timing import line_times

EXAMPLE = ROOT / "docs" / "plan" / "hall-2.toml"
MASTER = '[master]\npolarization = {rp}\nterminator = "RC"\n'


Written = Callable[[str], LinePlan]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """Write a plan and read it."""

    def write(text: str) -> LinePlan:
        path = tmp_path / "p.toml"
        path.write_text(text, "utf-8")
        return read_plant(path)

    return write


def station(number: int, **fields: object) -> str:
    """A station as TOML; an Altivar 31 with known lengths if nothing else is named."""
    all_fields = {"address": number, "profile": "atv31", "cable": 10, "stub": 1, **fields}
    rows = [f"{key} = {json.dumps(value)}" for key, value in all_fields.items()]
    return "\n".join(["[[stations]]", *rows, ""])


def line(*stations: str, rp: int = 650, head: str = "") -> str:
    """A plan whose last station has the terminator of the end."""
    *first, last = stations
    end = "" if "terminator" in last else 'terminator = "RC"\n'
    return "\n".join(["format = 1", head, MASTER.format(rp=rp), *first, last + end])


def findings(plan: LinePlan, severity: str = "error") -> list[PlanFinding]:
    return [f for f in plan_findings(plan, line_times(plan)) if f.severity == severity]


def subjects(plan: LinePlan, severity: str = "error") -> list[str]:
    return [finding.subject for finding in findings(plan, severity)]


def polarized(count: int, **fields: object) -> list[str]:
    """Devices of another kind with 4.7 kohm."""
    return [station(n, profile="", polarization=4700, **fields) for n in range(1, count + 1)]


def test_example_keeps_every_limit_and_its_schema_is_up_to_date() -> None:
    assert plan_findings(read_plant(EXAMPLE), line_times(read_plant(EXAMPLE))) == []
    assert EXAMPLE.with_name("plan.schema.json").read_text("utf-8") == plant_schema()


# Polarization, by the formulas of the manuals


@pytest.mark.parametrize(
    ("rp", "count", "re"), [(470, 2, 392), (587, 2, 470), (898, 2, 650), (470, 18, 168)]
)
def test_polarization_of_a_mixed_line_is_that_of_the_manuals(
    written: Written, rp: int, count: int, re: int
) -> None:
    plan = written(line(*polarized(count), rp=rp))
    assert plan.schematic.id == "mixed"
    assert round(total_ohm(plan) or 0) == re
    assert subjects(plan) == []


def test_master_resistor_for_the_recommended_polarization(written: Written) -> None:
    assert best_master_ohm(written(line(*polarized(2)))) == 898
    assert best_master_ohm(written(line(*polarized(8)))) is None


WRONG_POLARIZATION = {
    "19 stations at 470 ohm": (line(*polarized(19), rp=470), "19 stations have a polarization."),
    "too much of it": (line(*polarized(20), rp=470), "give Re = 157 ohm, not 162 to 650."),
    "too little of it": (line(*polarized(2), rp=0), "give Re = 2350 ohm"),
    "none at all": (line(station(1), rp=0), "No device has a polarization. Install 450 to 650"),
    "too weak at the master": (line(station(1), rp=700), "The master has 700 ohm. It needs 450"),
    "too strong at the master": (line(station(1), rp=449), "The master has 449 ohm. It needs 450"),
    "not in every station": (
        line(station(1), *polarized(2)[1:], rp=4700, head='schematic = "uni-telway"'),
        "4700 ohm belong in every station and the master. Without it: station 1.",
    ),
}


@pytest.mark.parametrize("name", WRONG_POLARIZATION)
def test_wrong_polarization_is_an_error_that_names_the_chapter(written: Written, name: str) -> None:
    text, expected = WRONG_POLARIZATION[name]
    found = [f for f in findings(written(text)) if f.subject == "Polarization"]
    assert any(expected in finding.text for finding in found), found
    assert all("schematic" in f.chapter or "Altivar" in f.chapter for f in found)


@pytest.mark.parametrize("rp", [450, 650])
def test_polarization_at_the_limits_of_the_manuals_is_kept(written: Written, rp: int) -> None:
    assert subjects(written(line(station(1), rp=rp))) == []


def test_polarization_that_a_drive_cannot_have_is_a_warning(written: Written) -> None:
    plan = written(
        line(station(1, polarization=4700), station(2, profile="atv21", polarization=4700))
    )
    (found,) = findings(plan, "warning")
    assert (found.addresses, found.chapter.split(":")[0]) == ((1,), "Altivar 31")


def test_unknown_polarization_of_a_leroy_somer_drive_is_reported(written: Written) -> None:
    plan = written(line(station(1, profile="powerdrive"), head='characters = "8N2"'))
    assert subjects(plan, "error") == []
    assert [f.subject for f in findings(plan, "warning")] == ["Polarization"]
    assert [f.subject for f in findings(plan, "note")] == ["Limits"]
    known = written(
        line(station(1, profile="powerdrive", polarization=0), head='characters = "8N2"')
    )
    assert subjects(known, "warning") == []


# Counts, lengths, tap links, terminators


@pytest.mark.parametrize(("count", "broken"), [(31, []), (32, ["Stations"])])
def test_slaves_are_counted(written: Written, count: int, broken: list[object]) -> None:
    assert subjects(written(line(*(station(n) for n in range(1, count + 1))))) == broken


@pytest.mark.parametrize(
    ("schematic", "count", "length"), [("uni-telway", 28, 1000), ("jbus", 31, 1300)]
)
def test_older_schematics_have_limits_of_their_own(
    written: Written, schematic: str, count: int, length: int
) -> None:
    def of(stations: int, meters: float) -> set[str]:
        head = f'schematic = "{schematic}"'
        rows = [station(n, cable=meters / stations) for n in range(1, stations + 1)]
        return {f.subject for f in findings(written(line(*rows, head=head)))}

    assert not of(count, length) & {"Stations", "Length"}
    assert {"Stations", "Length"} <= of(count + 1, length + 1)


@pytest.mark.parametrize(
    ("head", "length", "found"),
    [("", 1000, ""), ("", 1001, "error"), ("baud = 38400", 100, "warning")],
)
def test_length_is_compared_at_the_baud_rate_of_the_manual(
    written: Written, head: str, length: int, found: str
) -> None:
    plan = written(line(station(1, profile="atv71", cable=length), head=head))
    reported = [f.severity for f in plan_findings(plan, line_times(plan)) if f.subject == "Length"]
    assert reported == ([found] if found else [])


@pytest.mark.parametrize(
    ("stubs", "head", "broken"),
    [
        ([20], "", []),
        ([20.1], "", [1]),
        ([20, 20], "", []),
        ([13.3, 13.3, 13.4], "", [3]),
        ([3.1], 'schematic = "jbus"', [1]),
    ],
)
def test_tap_links_of_a_box_share_their_length(
    written: Written, stubs: list[float], head: str, broken: list[object]
) -> None:
    rows = [
        station(n, stub=stub, box="A", **({} if n == 1 else {"cable": 0}))
        for n, stub in enumerate(stubs, 1)
    ]
    found = [f for f in findings(written(line(*rows, head=head))) if f.subject == "Tap links"]
    assert [address for finding in found for address in finding.addresses] == broken


def test_line_without_polarization_may_have_150_ohm_at_its_ends(written: Written) -> None:
    text = line(station(1, terminator="R"), rp=0).replace('"RC"', '"R"')
    plan = written(text)
    assert (subjects(plan), subjects(plan, "warning")) == ([], ["Polarization"])
    bare = line(station(1, terminator="none"), rp=0)
    assert [f.text[-7:] for f in findings(written(bare)) if f.subject == "Termination"] == [
        "Fit RC."
    ]


def test_line_without_a_profile_has_limits_that_are_marked(written: Written) -> None:
    plan = written(line(station(1, profile="", polarization=0)))
    assert [f.text[:33] for f in findings(plan, "note")] == ["No station has a profile. The lim"]
    assert line_times(plan).timeouts == []


WRONG_TERMINATION = {
    "none": (station(1, terminator="none"), "has no terminator. Fit RC."),
    "150 ohm": (station(1, terminator="R"), "is R. Fit RC."),
}


@pytest.mark.parametrize("name", WRONG_TERMINATION)
def test_wrong_terminator_at_an_end_is_an_error(written: Written, name: str) -> None:
    row, expected = WRONG_TERMINATION[name]
    (found,) = findings(written(line(row)))
    assert (found.subject, found.addresses) == ("Termination", (1,))
    assert found.text.endswith(expected)


def test_terminator_between_the_ends_is_an_error(written: Written) -> None:
    (found,) = findings(written(line(station(1, terminator="RC"), station(2))))
    assert found.text == "A terminator at station 1 is not at an end of the line. Remove it."


def test_master_in_the_middle_has_no_terminator(written: Written) -> None:
    text = line(station(1, cable=0, terminator="RC"), station(2)).replace(
        'terminator = "RC"', "position = 1\ncable = 5", 1
    )
    plan = written(text)
    assert subjects(plan) == []
    assert [getattr(item, "address", "master") for item in plan.elements] == [1, "master", 2]


# Addresses, settings, times


@pytest.mark.parametrize(
    ("fields", "head", "subject"),
    [
        ({"address": 10, "profile": "powerdrive", "polarization": 0}, "", "Addresses"),
        ({"address": 0, "profile": ""}, "", "Addresses"),
        ({"profile": "atv21"}, "baud = 38400", "Settings"),
        ({"profile": "atv21"}, 'characters = "8N2"', "Settings"),
        ({}, "period = 0.01", "Cycle time"),
        ({"timeout": 0.1}, "", "Timeouts"),
        ({"timeout": 31}, "", "Timeouts"),
    ],
)
def test_drive_that_does_not_fit_the_line_is_an_error(
    written: Written, fields: dict[str, object], head: str, subject: str
) -> None:
    row = station(1, **fields)
    found = findings(written(line(row, head=head)))
    assert subject in [f.subject for f in found]
    assert all(f.chapter for f in found)


def test_cycle_is_the_sum_of_the_read_plans(written: Written) -> None:
    codes = ["ETA", "RFR", "LCR"]
    rows = [station(n, profile="atv71", values=codes, writes=2) for n in (1, 2)]
    times = line_times(written(line(*rows)))
    timing = WireTiming(11 / 19200, 3.5 * 11 / 19200, 0.005)
    each = plan_reads(library.load("atv71"), codes, timing).seconds + timing.write(2, multiple=True)
    assert times.cycle == pytest.approx(2 * each)
    assert times.singly > times.cycle
    assert times.by_baud[9600] > times.by_baud[19200] > times.by_baud[38400]
    assert times.longest == pytest.approx(times.cycle + 3 * times.reply)
    assert [item.suitable for item in times.timeouts] == [0.8, 0.8]
    assert min(item.shortest for item in times.timeouts) >= 2 * times.longest


# Parts and the diagram


def test_parts_are_those_of_the_manuals_by_the_way_of_cabling(written: Written) -> None:
    def numbers(way: str, *rows: str) -> dict[str, int]:
        plan = written(line(*rows, head=f'way = "{way}"'))
        return {row.number: row.count for row in parts_list(plan).rows}

    far = [station(1, cable=120, stub=2), station(2, cable=30, stub=3)]
    assert numbers("rj45", *far) == {
        "LU9 GC3": 2, "VW3 A8 306 R30": 2, "VW3 A8 306 RC": 1, "TSX CSA 200": 1
    }  # fmt: skip
    assert numbers("boxes", *far) == {"TSX SCA 50": 2, "VW3 A8 306 D30": 2, "TSX CSA 200": 1}
    assert numbers("sub_d", *far) == {"TSX SCA 62": 2, "VW3 A8 306": 2, "TSX CSA 200": 1}
    near = [station(1, cable=3, stub=0.3), station(2, cable=1, stub=1)]
    assert numbers("rj45", *near) == {
        "VW3 A8 306 TF03": 1, "VW3 A8 306 TF10": 1, "VW3 A8 306 RC": 1,
        "VW3 A8 306 R10": 1, "VW3 A8 306 R30": 1,
    }  # fmt: skip


def test_part_that_no_manual_names_is_reported(written: Written) -> None:
    remarks = parts_list(written(line(station(1, stub=15)))).remarks
    assert "No cable for the tap link of station 1 has 15 m." in remarks
    only = parts_list(written(line(station(1, profile="powerdrive"), head='characters = "8N2"')))
    assert (only.rows, len(only.remarks)) == ([], 1)


def test_diagram_has_every_element_and_marks_the_wrong_ones(written: Written) -> None:
    plan = written(line(station(1, stub=25, name="A\u001b[2J<&"), station(2, name="B")))
    found = plan_findings(plan, line_times(plan))
    text = "\n".join(diagram_text(plan, found))
    assert " ! +---   25 m --- 1  A" in text
    assert "   +---    1 m --- 2  B  Altivar 31  [120 ohm + 1 nF]" in text
    svg = diagram_svg(plan, found)
    assert "\u001b" not in text + svg
    texts = [e.text for e in ElementTree.fromstring(svg).iter() if e.tag.endswith("text")]
    assert len([t for t in texts if t and t.startswith(("1  A", "2  B", "Master"))]) == 3


def test_long_names_are_cut_in_the_diagram(written: Written) -> None:
    plan = written(line(station(1, name="N" * 400), station(2)))
    assert max(map(len, diagram_text(plan, []))) <= 80
    assert f"{'N' * 27}…" in diagram_svg(plan, [])


# The file


FAULTS = {
    "no stations": ("format = 1\n", "1: the field `stations` is missing: "),
    "field": (line(station(1, stubs=3)), "12: station 1, stubs: `stubs` is not a field"),
    "address": (line(station(300)), "8: station 1, address: must be <= 247, not 300"),
    "length": (line(station(1, cable=-1)), "10: station 1, cable: must be >= 0, not -1"),
    "two of an address": (
        line(station(1), station(1)), "14: station 2, address: 1 is also the address of station 1.",
    ),
    "profile": (line(station(1, profile="atv99")), "9: station 1, profile: "),
    "code": (
        line(station(1, values=["NOSUCH"])),
        "12: station 1, values: 'NOSUCH' is not a parameter of Altivar 31 that can be read.",
    ),
    "codes of no drive": (
        line(station(1, profile="", values=["ETA"])),
        "12: station 1, values: codes need a `profile`",
    ),
    "master": (
        line(station(1)).replace("[master]", '[master]\nkind = "PLC"'),
        "4: master, kind: 'PLC' is not a kind of master. Allowed: 'Twido",
    ),
    "position": (
        line(station(1)).replace("[master]", "[master]\nposition = 2"),
        "4: master, position: the line has 1 stations, not 2.",
    ),
    "box": (
        line(station(1, box="A"), station(2), station(3, box="A")),
        "25: station 3, box: the stations of box 'A' must follow each other.",
    ),
    "not TOML": ("format = \n", "1: Invalid value."),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_fault_of_a_file_has_its_line_and_key(written: Written, name: str, tmp_path: Path) -> None:
    text, expected = FAULTS[name]
    with pytest.raises(PlantFileError) as caught:
        written(text)
    reported = [
        row.replace(f"{tmp_path / 'p.toml'}:", "") for row in str(caught.value).splitlines()
    ]
    assert any(row.startswith(expected) for row in reported), reported


# From a scan


def scan_text(*hits: dict[str, object]) -> str:
    rows = [
        {"command": "scan", "line": "L", "event": "hit", "baud": 19200, "format": "8E1", **hit}
        for hit in hits
    ]
    return "\n".join(map(json.dumps, [{"command": "scan", "event": "families"}, *rows]))


def test_plan_of_a_scan_can_be_read(tmp_path: Path) -> None:
    scan, plan = tmp_path / "scan.json", tmp_path / "p.toml"
    scan.write_text(
        scan_text(
            {"device": 7, "profile": None, "reference": 'X"\u001b'},
            {"device": 2, "profile": "atv71", "name": "MACHINE 4"},
        ),
        "utf-8",
    )
    plan.write_text(plant_of_scan(scan), "utf-8")
    read = read_plant(plan)
    assert [(s.address, s.profile, s.name) for s in read.file.stations] == [
        (2, "atv71", "MACHINE 4"), (7, "", 'X"\u001b'),
    ]  # fmt: skip
    assert "\u001b" not in plan.read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ": no drive of a scan."),
        ("{", ":1: not valid JSON."),
        ("[" * 100_000, ":1: not valid JSON."),
        (scan_text({"device": "2"}), ":2: device: must be an address, 0 to 247."),
        (scan_text({"device": True}), ":2: device: must be an address, 0 to 247."),
        (scan_text({"device": 248}), ":2: device: must be an address, 0 to 247."),
        ('{"command": "scan", "event": "ended"}', ": no drive of a scan."),
    ],
)
def test_file_without_a_scan_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "scan.json"
    path.write_text(text, "utf-8")
    with pytest.raises(NotAScan) as caught:
        plant_of_scan(path)
    assert str(caught.value).startswith(f"{path}{expected}")
