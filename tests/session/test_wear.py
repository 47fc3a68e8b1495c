"""Counts of writes to EEPROM: which count, where they are kept, and when a person must agree."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest

from tests.session.sets_bench import bench
from tests.session.test_journal import entry
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.schema import When
from tui.drive.settings.memory_orders import eeprom_use
from tui.session.drive import DriveSession
from tui.session.eeprom_counts import (
    COUNTED_DAY,
    COUNTS_NAME,
    DRIVES_KEPT,
    DriveCounts,
    EepromCounts,
    EepromTally,
    EepromWrite,
)
from tui.session.journal import Journal
from tui.session.settings.applied import EditOutcome
from tui.session.settings.eeprom import save_to_eeprom
from tui.session.settings.wear import ASK_FROM, WARN_FROM, Wear, WearGate

NOW = 1_800_000_000.0


def write(number: int = 0, *, code: str = "", drive: str = "A", device: int = 2) -> EepromWrite:
    """A write to a drive of one line, a minute after the one before."""
    return EepromWrite("/dev/ttyUSB0", device, "atv71", drive, code, NOW + 60 * number)


def counts_of(counts: EepromCounts, drive: str = "A", device: int = 2) -> DriveCounts:
    return counts.counts_of("/dev/ttyUSB0", device, "atv71", drive)


@pytest.mark.parametrize(
    ("profile", "code", "raw", "use"),
    [
        ("atv71", "CMI", 0x0002, "save"),
        ("atv71", "CMI", 0x0403, "save"),
        ("atv71", "CMI", 0x0001, ""),
        ("atv71", "SCS", 2, "save"),
        ("atv71", "SCS", 0, ""),
        ("atv71", "ACC", 30, ""),
        ("atv31", "SCS", 2, "save"),
        ("atv31", "SCS", 3, ""),
        ("atv31", "CMI", 0x0002, "save"),
        ("atv21", "ACC", 30, "write"),
        ("atv21", "FA00", 0xC400, ""),
        ("atv21", "FA01", 6000, ""),
        ("powerdrive", "6.42", 1, ""),
    ],
)
def test_eeprom_use_by_family(profile: str, code: str, raw: int, use: str) -> None:
    family = library.load(profile)
    assert eeprom_use(family, family[code], raw) == use


def test_negative_word_saves_as_its_bits_do() -> None:
    saves = [When(parameter="P", values=[0xFFFF])]
    memory = SimpleNamespace(save=None, eeprom=SimpleNamespace(also_saved_by=saves))
    family = cast(Any, SimpleNamespace(data=SimpleNamespace(memory=memory)))
    word = cast(Any, SimpleNamespace(code="P", storage="none"))
    assert [eeprom_use(family, word, raw) for raw in (-1, 0xFFFF, 0x7FFF)] == ["save", "save", ""]
    memory.save = SimpleNamespace(parameter="P", raw=-1, bit=False)
    memory.eeprom.also_saved_by = []
    assert [eeprom_use(family, word, raw) for raw in (-1, 0xFFFF, 0x7FFF)] == ["save", "save", ""]


@pytest.mark.parametrize(
    ("storage", "use"), [("unknown", "write"), ("eeprom", "write"), ("ram", "")]
)
def test_setting_that_may_be_stored_counts_as_stored(storage: str, use: str) -> None:
    family = library.load("atv71")
    setting = msgspec.structs.replace(family["ACC"], storage=storage)
    assert eeprom_use(family, setting, 30) == use


def test_counts_are_added_by_identity_and_parameter(tmp_path: Path) -> None:
    counts = EepromCounts(tmp_path)
    counts.add([write(0), write(1), write(2, code="ACC"), write(3, drive="B")])
    EepromCounts(tmp_path).add([write(4), write(5, device=3)])
    assert counts_of(counts).saves.count == 3
    assert counts_of(counts).saves.first == NOW
    assert counts_of(counts).of("ACC").count == 1
    assert counts_of(counts, "B").saves.count == 1
    assert counts_of(counts, device=3).saves.count == 1
    assert counts_of(counts, "C").saves.count == 0


def test_drive_without_identity_is_the_last_one_at_its_place(tmp_path: Path) -> None:
    counts = EepromCounts(tmp_path)
    counts.add([write(0, drive=""), write(1, drive="A")])
    assert counts_of(counts, "A").saves.count == 2
    counts.add([write(2, drive="B"), write(3, drive="")])
    assert counts_of(counts, "").saves.count == 2
    assert counts_of(counts, "A").saves.count == 2


def test_damaged_counts_are_kept_and_begin_again(tmp_path: Path) -> None:
    counts = EepromCounts(tmp_path)
    (tmp_path / COUNTS_NAME).write_text('{"drives": [{"li')
    with pytest.raises(ValueError, match="truncated"):
        counts_of(counts)
    counts.add([write()])
    assert counts_of(counts).saves.count == 1
    assert next(tmp_path.glob("*.damaged1")).read_text() == '{"drives": [{"li'


def test_counts_keep_only_times_of_the_last_day_and_the_last_drives(tmp_path: Path) -> None:
    counts = EepromCounts(tmp_path)
    far = write()._replace(time=NOW + 2 * COUNTED_DAY)
    counts.add([write(0), far, *(write(n, drive=f"D{n}") for n in range(1, DRIVES_KEPT + 1))])
    assert counts_of(counts).saves.times == [far.time]
    assert counts_of(counts, "D1").saves.count == 0
    assert counts_of(counts, "D2").saves.count == 1


def test_counts_that_cannot_be_stored_leave_the_file_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts = EepromCounts(tmp_path)
    counts.add([write()])

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full)
        with pytest.raises(OSError, match="No space"):
            counts.add([write(1)])
    assert counts_of(counts).saves.count == 1
    assert [path.name for path in tmp_path.glob("eeprom*")] == [COUNTS_NAME]


def worn(count: int, *, every: float = 60.0, profile: str = "atv71") -> Wear:
    """The wear after so many writes, the last one now."""
    times = [NOW - every * place for place in reversed(range(count))][-30:]
    known = EepromTally(count, NOW - every * count, NOW, times)
    return Wear.of(known, library.load(profile).data.memory.eeprom, NOW)


def test_wear_warns_then_asks_if_writes_are_frequent() -> None:
    assert not worn(WARN_FROM - 1).is_frequent
    assert worn(WARN_FROM).is_frequent
    assert not worn(ASK_FROM - 1).must_ask
    assert worn(ASK_FROM).must_ask
    assert not worn(19, every=3600).is_frequent
    assert worn(20, every=3600).is_frequent
    assert not worn(20, every=3600).must_ask


def test_wear_asks_near_the_end_of_the_stated_life() -> None:
    assert not worn(89_999, every=COUNTED_DAY).must_ask
    assert worn(90_000, every=COUNTED_DAY).must_ask
    assert worn(9_000, every=COUNTED_DAY, profile="atv21").must_ask
    assert not worn(1_000_000, every=COUNTED_DAY, profile="atv31").must_ask


def test_wear_text_has_life_pace_and_certainty() -> None:
    text = worn(10).text
    assert "10 writes from this computer since" in text
    assert "In the last hour: 10." in text
    assert "about 100,000 writes." in text
    assert "worn out in 416 days" in text
    assert "by a manual of a sister family" in worn(1, profile="atv21").text
    assert "No available document" in worn(1, profile="atv31").text


def saved_times(journal: Journal, session: DriveSession, count: int) -> None:
    """Note saves of the last seconds."""
    place = (session.line_text, session.device, session.profile.id, session.known_identity.text)
    now = time.time()
    journal.eeprom.add([EepromWrite(*place, "", now - n) for n in reversed(range(count))])


async def test_frequent_save_is_warned_then_refused_then_written_with_consent() -> None:
    with bench("atv71") as made:
        session, journal = made.session, made.journal
        heard: list[str] = []

        def gate(*codes: str) -> WearGate:
            return WearGate(journal.eeprom, codes, warn=heard.append, way="Use {code}.")

        saved_times(journal, session, ASK_FROM - 1)
        await save_to_eeprom(session, journal, made.permit(), gate())
        assert [text.partition(" write")[0] for text in heard] == ["EEPROM, All settings: 9"]
        assert await asyncio.to_thread(journal.flush)
        with pytest.raises(DriveError, match=r"Not written: .*In the last hour: 10\..* Use CMI\."):
            await save_to_eeprom(session, journal, made.permit(), gate())
        await save_to_eeprom(session, journal, made.permit(), gate("CMI"))
        assert await asyncio.to_thread(journal.flush)
        assert [entry.eeprom for entry in journal.recent] == ["save", "save"]
        place = (session.line_text, session.device, "atv71", "")
        assert journal.eeprom.counts_of(*place).saves.count == ASK_FROM + 1


async def test_frequent_write_is_refused_in_a_family_that_stores_each_write() -> None:
    with bench("atv21") as made:
        gate = WearGate(made.journal.eeprom)
        place = (made.session.line_text, made.session.device, "atv21", "")
        times = [time.time() - n for n in reversed(range(ASK_FROM))]
        made.journal.eeprom.add([EepromWrite(*place, "ACC", each) for each in times])
        edits = await made.stage(ACC="4")
        refused = await made.write(edits, gate=gate)
        assert [result.outcome for result in refused.results] == [EditOutcome.REFUSED]
        assert "ACC would go to EEPROM again" in refused.results[0].text
        done = await made.write(edits, gate=WearGate(made.journal.eeprom, ("ACC",)))
        assert [result.outcome for result in done.results] == [EditOutcome.DONE]
        assert await asyncio.to_thread(made.journal.flush)
        assert made.journal.eeprom.counts_of(*place).of("ACC").count == ASK_FROM + 1


async def test_save_passes_with_a_warning_if_the_counts_cannot_be_read() -> None:
    with bench("atv71") as made:
        path = made.journal.eeprom.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("no counts")
        heard: list[str] = []
        gate = WearGate(made.journal.eeprom, warn=heard.append)
        text = await save_to_eeprom(made.session, made.journal, made.permit(), gate)
        assert "saved to EEPROM" in text
        assert "not known" in heard[0]


def test_write_that_was_not_sent_is_not_counted(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    mark = replace(entry(1), eeprom="save", drive="A")
    journal.add(mark, sent=False)
    journal.add(mark)
    assert journal.flush(60)
    assert journal.eeprom.counts_of(mark.line, mark.device, mark.profile, "A").saves.count == 1
