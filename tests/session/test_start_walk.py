"""Start of a slow drive: each word after its state; its record."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from tests.waiting import until
from tui.session.command import access, motor_start
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.read.reader import Reader
from tui.session.work import OutcomeKind

from .slow_drive import ENABLED, READY, STATUS, SWITCHED_ON, SlowBench


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read the state as fast as possible."""
    monkeypatch.setattr(access, "STATE_POLL_INTERVAL", 0.0)
    monkeypatch.setattr(motor_start, "STATE_POLL_INTERVAL", 0.0)


@pytest.fixture
async def here(tmp_path: Path) -> AsyncIterator[SlowBench]:
    """A drive that takes three reads for each step."""
    made = SlowBench(tmp_path)
    yield made
    made.end()


async def test_no_word_is_sent_before_its_required_state(here: SlowBench) -> None:
    kind, text = await here.start()
    assert kind is OutcomeKind.DONE, text
    assert here.line.words == [(0x06, 0x0240), (0x07, READY), (0x0F, SWITCHED_ON)]


async def test_drive_that_stays_in_its_state_gets_no_more_words(
    here: SlowBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "STEP_TIME", 0.05)
    here.line.looks = 1_000_000
    kind, text = await here.start()
    assert kind is OutcomeKind.REFUSED
    assert "does not go to" in text
    assert [word for word, _ in here.line.words] == [0x06]
    # nothing was started: nothing is on record
    assert here.starts.close(5.0)
    assert here.records == []


async def test_start_is_on_the_disk_before_the_first_frame(here: SlowBench) -> None:
    seen: list[int] = []
    here.line.before_write = lambda _address: seen.append(len(here.records))
    assert (await here.start())[0] is OutcomeKind.DONE
    assert set(seen) == {1}


async def test_standstill_read_just_after_the_run_word_keeps_the_record(here: SlowBench) -> None:
    """The state of a slow drive is still the one before its start, but the motor runs."""
    assert (await here.start())[0] is OutcomeKind.DONE
    assert here.line.registers[STATUS] == ENABLED
    assert here.starts.close(5.0)
    assert len(here.records) == 1


async def test_unrecordable_start_is_refused(here: SlowBench) -> None:
    here.starts.folder.parent.mkdir(exist_ok=True)
    here.starts.folder.write_text("no folder")
    kind, text = await here.start()
    assert kind is OutcomeKind.REFUSED
    assert "was not recorded" in text
    assert here.line.words == []


async def test_refused_start_keeps_the_record_of_the_running_motor(here: SlowBench) -> None:
    await here.start()
    here.line.dead_to_writes = True
    kind, _ = await here.start()
    assert kind is OutcomeKind.REFUSED
    assert here.starts.close(5.0)
    assert len(here.records) == 1
    here.rest()
    await Reader(here.session).read(["ETA"])
    assert here.starts.close(5.0)
    assert here.records == [], "its standstill counts as before"


async def test_record_ends_at_standstill_not_at_the_stop(here: SlowBench) -> None:
    """A stop that never reached the drive leaves the start to be found by the next program."""
    await here.start()
    here.line.dead_to_writes = True
    stopper = Stopper(here.line, here.journal)
    stopper.stop([here.session])
    await until(lambda: stopper.reports[1].phase is Phase.FAILED)
    assert here.starts.close(5.0)
    assert len(here.records) == 1
    here.rest()
    here.line.dead_to_writes = False
    stopper.stop([here.session])
    await until(lambda: stopper.reports[1].phase is Phase.STOPPED)
    assert here.starts.close(5.0)
    assert here.records == []
