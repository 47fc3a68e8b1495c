"""Register features of profiles: input registers, fields of a word, word order, memory."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import pytest

from tui.bus.errors import RequestRefused
from tui.bus.requests import Read, ReadInput, WriteOne
from tui.drive.errors import ProfileError, ValueRefused
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import plan_reads
from tui.drive.values import to_words
from tui.session.connect.limits import limits_of
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.read.reader import Reader
from tui.session.settings.eeprom import save_to_eeprom
from tui.session.settings.write import NotTaken, Writer
from tui.session.work import Permit

from .fakes import OneDrive, parameter, profile_of

FUNCTIONS = [
    {"code": 3, "name": "Read", "max_read": 8},
    {"code": 4, "name": "Read input", "max_read": 4},
    {"code": 6, "name": "Write"},
]
FIELDS = profile_of(
    parameter("LOW", 10, mask=0xF),
    parameter("MID", 10, mask=0x7, shift=4, values={"0": "Off", "1": "On"}),
    parameter("TOP", 10, mask=0x1, shift=15),
    parameter("WHOLE", 11),
    parameter("SPEED", 10, function=4, access="r"),
    parameter("AMPS", 11, function=4, access="r", type="int16"),
    functions=FUNCTIONS,
)


def armed(line: OneDrive, profile: Profile) -> DriveSession:
    session = DriveSession(line, 1, profile)
    session.arming.arm(seconds=math.inf)
    return session


async def test_fields_of_one_register_need_one_read() -> None:
    line = OneDrive({10: 0x8015, 11: 7})
    session = armed(line, FIELDS)
    readings = await Reader(session).read(["LOW", "MID", "TOP", "WHOLE"])
    assert {code: reading.raw for code, reading in readings.items()} == {
        "LOW": 5, "MID": 1, "TOP": 1, "WHOLE": 7,
    }  # fmt: skip
    mid = readings["MID"].value
    assert mid is not None
    assert mid.text == "On"
    assert line.requested == [(10, 2)]


async def test_field_write_keeps_the_other_fields(journal: Journal) -> None:
    line = OneDrive({10: 0x8015})
    session = armed(line, FIELDS)
    writer = Writer(session, journal, session.work.permit())
    await writer.write_parameter(FIELDS["MID"], 6, why="setting")
    assert line.registers[10] == 0x8065
    await writer.write_parameter(FIELDS["LOW"], 0, why="setting")
    assert line.registers[10] == 0x8060
    assert session.image.raws["LOW"] == 0
    line.registers[10] = 0x1F00  # another master wrote in the meantime: its value stays
    await writer.write_parameter(FIELDS["TOP"], 1, why="setting")
    assert line.registers[10] == 0x9F00
    with pytest.raises(ValueRefused, match="does not fit"):
        await writer.write_parameter(FIELDS["MID"], 8, why="setting")
    assert line.registers[10] == 0x9F00


async def test_field_not_kept_by_the_drive_is_reported(journal: Journal) -> None:
    line = OneDrive({10: 0x8015})
    session = armed(line, FIELDS)
    taking = line.devices[1].take
    line.devices[1].take = lambda address, values: taking(address, [0x8015 for _ in values])  # type: ignore[method-assign]
    with pytest.raises(NotTaken, match="MID was written"):
        await Writer(session, journal, session.work.permit()).write_parameter(
            FIELDS["MID"], 6, why="setting"
        )


def test_field_needs_its_whole_word() -> None:
    with pytest.raises(ValueRefused, match="a part of a word"):
        to_words(FIELDS["MID"], 1)
    assert to_words(FIELDS["MID"], 1, 0xFFFF) == (0xFF9F,)


def test_registers_of_functions_3_and_4_are_read_separately() -> None:
    plan = plan_reads(FIELDS, ["LOW", "WHOLE", "SPEED", "AMPS"])
    requested = sorted(
        (request.function, request.address, request.count) for request in plan.requests
    )
    assert requested == [(3, 10, 2), (4, 10, 2)]


async def test_input_register_is_read_by_function_4() -> None:
    line = OneDrive({10: 0xFFFE, 11: 0xFFFE})
    session = armed(line, FIELDS)
    readings = await Reader(session).read(["AMPS", "WHOLE"])
    assert (readings["AMPS"].raw, readings["WHOLE"].raw) == (-2, 0xFFFE)
    assert set(line.requests) == {ReadInput(1, 11, 1), Read(1, 11, 1)}
    assert ReadInput(1, 11, 2).pdu() == bytes([4, 0, 11, 0, 2])


async def test_function_4_has_its_own_limit() -> None:
    line = OneDrive(dict.fromkeys(range(20), 0))
    line.describe(1, limits_of(FIELDS))
    await line.read(1, 0, 4, function=4)
    await line.read(1, 0, 8)
    with pytest.raises(RequestRefused, match="accepts 4"):
        await line.read(1, 0, 5, function=4)


LONG = """
[profile]
id = "long"
name = "Long"
vendor = "V"
version = "1"
{head}
[link]
baud = 9600
format = "8N1"
[reading]
low_word_first = false
[[sources]]
id = "m"
title = "m"
[[functions]]
code = 3
name = "Read"
max_read = 8
[monitoring]
values = []
[[parameters]]
code = "HOURS"
name = "Hours"
number = "1"
address = 1
type = "uint32"
access = "r"
group = "All"
source = "m"
confidence = "manual"
[[parameters]]
code = "ENERGY"
name = "Energy"
number = "3"
address = 3
type = "int32"
low_word_first = true
access = "r"
group = "All"
source = "m"
confidence = "manual"
"""
ROWS = """
[[sources]]
id = "shared"
title = "Of both"
[[parameters]]
code = "ACC"
name = "Acceleration"
number = "9"
address = 9
scale = "0.1"
unit = "s"
max = 999
access = "r"
group = "Ramps"
source = "shared"
confidence = "manual"
[[parameters]]
code = "DEC"
name = "Deceleration"
number = "10"
address = 10
access = "r"
group = "Ramps"
source = "shared"
confidence = "manual"
"""


async def test_word_order_is_reported_once(tmp_path: Path) -> None:
    path = tmp_path / "long.toml"
    path.write_text(LONG.format(head=""), encoding="utf-8")
    session = armed(OneDrive({1: 1, 2: 2, 3: 0xFFFF, 4: 0xFFFF}), library.load_file(path))
    readings = await Reader(session).read(["HOURS", "ENERGY"])
    assert (readings["HOURS"].raw, readings["ENERGY"].raw) == (0x10002, -1)
    session = armed(OneDrive({1: 1, 2: 2, 3: 1, 4: 2}), library.load_file(path))
    assert (await Reader(session).read(["ENERGY"]))["ENERGY"].raw == 0x20001


ROW = """[[parameters]]
code = "HOLD"
name = "Of its own"
number = "77"
address = 77
access = "r"
group = "All"
source = "m 1"
confidence = "manual"

"""


def shared(tmp_path: Path, more: str, head: str = 'rows_from = ["ramps.rows"]') -> Path:
    (tmp_path / "ramps.rows").write_text(ROWS, encoding="utf-8")
    path = tmp_path / "long.toml"
    path.write_text(LONG.format(head=head) + more, encoding="utf-8")
    return path


def test_shared_rows_are_merged_into_a_profile(tmp_path: Path) -> None:
    path = shared(tmp_path, '[[parameters]]\ncode = "ACC"\nmax = 500\n')
    assert library.faults_of(path) == []
    profile = library.load_file(path)
    assert [p.code for p in profile.parameters] == ["ACC", "DEC", "HOURS", "ENERGY"]
    ramp = profile["ACC"]
    assert (ramp.max, ramp.scale, ramp.unit, ramp.address) == (500, "0.1", "s", 9)
    assert [source.id for source in profile.data.sources] == ["shared", "m"]


def test_own_row_follows_the_row_above_it(tmp_path: Path) -> None:
    between = '[[parameters]]\ncode = "ACC"\n\n' + ROW.replace("HOLD", "OWN")
    path = shared(
        tmp_path,
        between + ROW.replace("HOLD", "NEXT").replace("77", "78").replace("its", "another"),
    )
    assert library.faults_of(path) == []
    codes = [p.code for p in library.load_file(path).parameters]
    assert codes == ["ACC", "OWN", "NEXT", "DEC", "HOURS", "ENERGY"]
    path.write_text(path.read_text("utf-8").replace("address = 78", "address = 77"), "utf-8")
    [reported] = library.faults_of(path)
    line = path.read_text("utf-8").splitlines().index('code = "NEXT"') + 1
    assert reported.startswith(f"{path}:{line + 3}: "), "a place is known after rows were moved"


def test_shared_row_can_be_omitted(tmp_path: Path) -> None:
    head = 'rows_from = ["ramps.rows"]\nwithout = ["ACC"]'
    profile = library.load_file(shared(tmp_path, "", head))
    assert [p.code for p in profile.parameters] == ["DEC", "HOURS", "ENERGY"]
    path = shared(tmp_path, "", head.replace('"ACC"', '"NONE"'))
    with pytest.raises(ProfileError, match=r"long\.toml:8: without: there is no shared row 'NONE'"):
        library.load_file(path)


def test_error_in_a_shared_row_is_reported_at_its_line(tmp_path: Path) -> None:
    path = shared(tmp_path, '[[parameters]]\ncode = "ACC"\nscale = "no"\n')
    (tmp_path / "ramps.rows").write_text(ROWS.replace("address = 10", "address = 9"), "utf-8")
    own, both = library.faults_of(path)
    line = path.read_text("utf-8").splitlines().index('scale = "no"') + 1
    assert own.startswith(f"{path}:{line}: ")
    assert both.startswith(f"{tmp_path / 'ramps.rows'}:21: ")
    assert "address 9 already belongs to ACC" in both


@pytest.mark.parametrize("name", ["none.rows", "../ramps.rows", "/etc/hosts"])
def test_shared_rows_outside_the_profile_folder_are_refused(tmp_path: Path, name: str) -> None:
    path = shared(tmp_path, "", f'rows_from = ["{name}"]')
    with pytest.raises(ProfileError, match=r"long\.toml:7: rows_from: "):
        library.load_file(path)


SAVING = {"save": {"parameter": "KEEP", "raw": 1, "does": "Saves.", "keeps_value": True}}
CHART = {
    "id": "c",
    "name": "C",
    "status": "STATE",
    "states": [{"id": "rest", "name": "Rest", "kind": "ready", "mask": 1, "value": 0}],
}


async def saved(
    line: OneDrive, journal: Journal, memory: Mapping[str, object], access: str = "rw"
) -> tuple[str, list[WriteOne]]:
    profile = profile_of(
        parameter("STATE", 1, access="r"),
        parameter("KEEP", 2, access=access),
        parameter("DONE", 3, access="r"),
        functions=FUNCTIONS,
        charts=[CHART],
        memory=memory,
    )
    session = armed(line, profile)
    permit: Permit = session.work.permit()
    reported = await save_to_eeprom(session, journal, permit)
    return reported, [request for request in line.requests if isinstance(request, WriteOne)]


async def test_save_word_may_keep_its_value(journal: Journal) -> None:
    reported, written = await saved(OneDrive({1: 0, 2: 0, 3: 0}), journal, SAVING)
    assert "saved" in reported
    assert written == [WriteOne(1, 2, 1)]


async def test_save_word_may_be_write_only(journal: Journal) -> None:
    line = OneDrive({1: 0, 2: 0, 3: 0})
    memory = {"save": {"parameter": "KEEP", "raw": 1, "does": "Saves."}}
    reported, written = await saved(line, journal, memory, "w")
    assert "saved" in reported
    assert written == [WriteOne(1, 2, 1)]


async def test_another_word_may_report_the_save(journal: Journal) -> None:
    line = OneDrive({1: 0, 2: 0, 3: 0})
    requested: list[int] = []
    held = line.devices[1].held

    def answer(address: int, count: int) -> tuple[int, ...]:
        if address <= 3 < address + count:
            requested.append(address)
            line.registers[3] = 5 if len(requested) > 3 else 0
        return held(address, count)

    line.devices[1].held = answer  # type: ignore[method-assign]
    done = {"parameter": "DONE", "values": [5]}
    reported, _ = await saved(line, journal, {"save": {**SAVING["save"], "done": done}})
    assert "saved" in reported
    assert len(requested) == 4
