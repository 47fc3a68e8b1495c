"""The report on a drive: every family, changed settings, journal entries."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from tests.programs import wait_until
from tests.session.sets_bench import FAMILIES, bench
from tests.sweeps import kept
from tui.session.connect.identify import identify_drive
from tui.session.journal import Entry
from tui.session.journal_reading import entries_of
from tui.session.read.upload import Upload
from tui.session.report import report_text

pytestmark = pytest.mark.long

SECTIONS = [
    "## Line settings of the drive",
    "## Settings changed from the factory",
    "## Control source",
    "## Indirect blocks and scanner",
    "## Loss of communication",
    "## Faults",
    "## Writes by Drive Panel",
]


@pytest.mark.parametrize("family", kept(FAMILIES, "atv71", "powerdrive"))
async def test_every_family_has_its_report(family: str) -> None:
    with bench(family, serial=True) as made:
        upload = Upload(made.session)
        await upload.run()
        text = report_text(made.profile, upload.parameter_set(), [])
    heads = [line for line in text.splitlines() if line.startswith("## ")]
    assert heads == SECTIONS
    assert text.startswith(f"# {made.profile.name} at serial:")
    for setting in made.profile.data.link.settings:
        assert f"| {setting.parameter} |" in text
    assert ("- Model by its own code: ATV21H" in text) is (family == "atv21")
    tables = [line.count(" | ") for line in text.splitlines() if line.startswith("| ")]
    assert tables


async def test_changed_settings_are_listed_with_old_values() -> None:
    with bench("atv312", sets={"ttO": 33}) as made:
        made.session.identity = await identify_drive(made.session.line, 1)
        await made.apply(SP2="7", ttO="5")
        made.drive.provoke("OCF")
        upload = Upload(made.session)
        await upload.run()
        entries = entries_of(made.journal, made.session.line_text, 1)
        assert [entry.code for entry in entries] == ["SP2", "ttO"]
        text = report_text(made.profile, upload.parameter_set(), entries)
        assert entries_of(made.journal, made.session.line_text, 2) == []
    rows = [line for line in text.splitlines() if line.startswith("| ttO |")]
    assert any(row.endswith("| 10.0 s | 5.0 s | 3.3 s |") for row in rows), rows
    assert "- Reference: ATV312" in text
    assert "OCF" in text.partition("## Faults")[2].partition("##")[0]
    faults = text.partition("## Faults")[2].partition("## ")[0]
    assert "What OCF Overcurrent points at:" in faults
    assert "- Probably (general practice): " in faults
    assert "- Check ACC, " in faults
    assert "- Reset (unverified): " in faults
    assert faults.count("points at:") == 1
    assert "| SP2 | 10.0 Hz | 7.0 Hz | ok | setting |" in text


@pytest.mark.parametrize(
    ("family", "code", "raw", "reported"),
    [
        ("atv21", "F803", 0, "Off"),
        ("atv21", "F803", 3, "3 s"),
        ("powerdrive", "15.07", 0, "Off"),
        ("powerdrive", "15.07", 30, "3.0 s"),
    ],
)
async def test_disabled_timeout_is_reported(
    family: str, code: str, raw: int, reported: str
) -> None:
    with bench(family, sets={code: raw}) as made:
        upload = Upload(made.session)
        await upload.run()
        text = report_text(made.profile, upload.parameter_set(), [])
    assert f"- Timeout ({code}): {reported}" in text.splitlines()


async def test_values_stored_with_a_fault_are_listed() -> None:
    with bench("atv71", run_hz=35.0) as made:
        await asyncio.to_thread(wait_until, lambda: made.drive.motor.frequency > 20, "it turns")
        made.drive.provoke("OCF")
        upload = Upload(made.session)
        await upload.run()
        held = upload.parameter_set()
        text = report_text(made.profile, held, [])
    assert text.count("What the drive stored with") == 1
    found = text.partition("What the drive stored with DP0, OCF Overcurrent:")[2].partition(
        "\nWhat "
    )[0]
    stored = made.profile.data.faults.stored[0]
    assert [line.split(" | ")[0] for line in found.splitlines()[4:] if line] == [
        f"| {code}" for code in stored
    ]
    assert held.raws[stored[0]] >= 200
    assert f"| {held.raws[stored[0]] / 10:.1f} Hz |" in found


async def test_scanner_slots_are_listed_with_their_parameters() -> None:
    with bench("atv71", sets={"NMA1": 3201, "NMA2": 0}) as made:
        upload = Upload(made.session)
        await upload.run()
        text = report_text(made.profile, upload.parameter_set(), [])
    assert f"| NMA1 | ETA {made.profile['ETA'].name} |" in text
    assert "| NMA2 | nothing |" in text
    assert "None." in text.partition("## Writes by Drive Panel")[2]


async def test_damaged_lines_of_the_journal_are_omitted() -> None:
    with bench("atv71") as made:
        await made.apply(ACC="5")
        made.journal.flush()
        path = made.journal.path
        path.with_name(f"{path.name}.1").write_text('{"half\n[1]\n{"a": 1}\n', encoding="utf-8")
        with path.open("a", encoding="utf-8") as file:
            file.write("cut short\n")
        entries = entries_of(made.journal, made.session.line_text, 1)
        assert [entry.code for entry in entries] == ["ACC"]


async def test_times_are_in_the_zone_of_the_reading() -> None:
    with bench("atv312") as made:
        await made.apply(SP2="7", ttO="5")
        upload = Upload(made.session, ["SP2"])
        await upload.run()
        values = upload.parameter_set()
        entries = entries_of(made.journal, made.session.line_text, 1)
    times = ("2026-10-25T02:30:00.000+02:00", "2026-10-25T02:30:00.000+01:00")
    entries = [replace(entry, time=time) for entry, time in zip(entries, times, strict=True)]
    values = replace(values, head=replace(values.head, time="2026-11-22T08:00:00+01:00"))
    text = report_text(made.profile, values, entries)
    assert "- Read: 2026-11-22 08:00:00; times here are UTC+01:00" in text
    written = text.partition("## Writes by Drive Panel")[2]
    assert written.index("2026-10-25 01:30:00") < written.index("2026-10-25 02:30:00")


async def test_report_lists_each_trip_once() -> None:
    with bench("atv71") as made:
        made.drive.provoke("OCF")
        upload = Upload(made.session)
        await upload.run()
        known = (made.session.line_text, 1, "atv71", "OCF", 0, None, "", 9, "Overcurrent")
        entries = [
            Entry(f"2026-03-01T10:00:0{n}.000+01:00", *known, "seen", None, "x", kind="fault")
            for n in range(5)
        ]
        text = report_text(made.profile, upload.parameter_set(), entries)
    rows = text.partition("## Trips seen by Drive Panel")[2].partition("## ")[0].splitlines()
    (row,) = [row for row in rows if "OCF" in row]
    assert row.startswith("| not seen | 2026-03-01 ")
