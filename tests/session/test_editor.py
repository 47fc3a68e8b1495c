"""Editing the parameters of simulated drives over a real line, as the screen does."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from tests.limits import WAS_OFF
from tests.line_events import on_event
from tests.session.fake_clock import FakeClock
from tests.sweeps import kept
from tests.ui import fakes
from tui.bus.fake import FakeLine
from tui.bus.line import Timing
from tui.bus.line_events import DeviceWritten
from tui.drive.errors import ValueRefused
from tui.drive.profile import library
from tui.drive.settings.parameter_set import dump_set
from tui.drive.settings.selection import FILTERS, rows
from tui.drive.settings.set_file import read_set, write_file
from tui.session.drive import DriveSession
from tui.session.monitor.trend import Trend
from tui.session.read.upload import Upload
from tui.session.reading import reading_of
from tui.session.settings.editor import Editor
from tui.session.settings.watched_values import WatchedValues
from tui.session.shown import Quality

from .test_command import FAMILIES, Bench, bench

pytestmark = pytest.mark.long


@asynccontextmanager
async def editing(family: str, **spec: object) -> AsyncIterator[tuple[Bench, Editor]]:
    """A drive with an editor that reads."""
    async with bench(family, **spec) as made:  # type: ignore[arg-type]
        editor = made.console.editor
        editor.values.start()
        try:
            yield made, editor
        finally:
            editor.values.stop()


async def read(made: Bench, editor: Editor, *codes: str) -> None:
    editor.values.visible = codes
    await made.until(lambda: all(code in editor.values.raws for code in codes))


async def written(made: Bench, editor: Editor) -> str:
    await made.until(lambda: not editor.busy and editor.message is not None)
    assert editor.message is not None
    return editor.message.text


# a number whose step may follow another word, on each family
NUMBERS = {"atv21": "ACC", "atv31": "ACC", "atv312": "ACC", "atv71": "ACC"}


@pytest.mark.parametrize("family", NUMBERS)
async def test_parameter_is_found_edited_applied_and_undone(family: str) -> None:
    async with editing(family) as (made, editor):
        code = NUMBERS[family]
        assert code in rows(editor.facts, "settings", "acc")
        await read(made, editor, code)
        before = editor.values.raws[code]
        editor.staging.stage(code, "7.5 s")
        assert editor.staging.edits.get(code) is not None
        editor.staging.undo(code)
        assert len(editor.staging.edits) == 0
        assert editor.values.raws[code] == before
        editor.staging.stage(code, "7.5 s")
        editor.apply()
        assert "Wrote 1, all verified" in await written(made, editor)
        assert made.drive.raw(code) == editor.values.raws[code] == 75
        assert len(editor.staging.edits) == 0
        assert editor.marks.recent[0] == code
        assert rows(editor.facts, "recent") == [code]


@pytest.mark.parametrize("family", kept(FAMILIES, "atv71", "powerdrive"))
async def test_selected_parameters_are_read_first(family: str) -> None:
    async with editing(family) as (made, editor):
        last = [p.code for p in editor.session.profile.parameters if p.access != "w"][-1]
        values = editor.values
        await made.until(
            lambda: last in values.raws or last in values.absent or values.progress[0] > 0
        )
        values.visible = (last,)
        await made.until(lambda: last in values.raws or last in values.absent)
        await made.until(lambda: values.progress[0] == values.progress[1], 60.0)
        for chosen in FILTERS:
            rows(editor.facts, chosen, "a")


async def test_only_edits_that_were_sent_are_marked_in_the_curve() -> None:
    async with editing("atv71") as (made, editor):
        trend = Trend(editor.session.profile)
        leave = on_event(made.line.facts, DeviceWritten, trend.note_write)
        trend.add(fakes.snapshot_of(editor.session.profile, fakes.READY))
        await read(made, editor, "ACC", "DEC")
        editor.staging.stage("ACC", "5")
        editor.staging.stage("DEC", "7")
        made.drive.set("ACC", 50)
        editor.apply()
        assert await written(made, editor) == "Wrote 1, all verified. Already held: 1."
        leave()
        point = trend.add(fakes.snapshot_of(editor.session.profile, fakes.READY))
        assert (point.mark, point.by) == ("write", (made.line.facts.me.text,))
        assert point.codes == ("DEC",)


async def test_refused_edit_stays_staged_with_its_reason() -> None:
    async with editing("atv71") as (made, editor):
        await read(made, editor, "HSP", "LSP", "TFR")
        editor.staging.stage("HSP", "70")
        editor.apply()
        output = await written(made, editor)
        assert output == "Nothing written. 1 still staged: HSP."
        assert "TFR" in editor.staging.results["HSP"].text
        assert editor.staging.edits.get("HSP") is not None
        assert made.drive.raw("HSP") == 500


async def test_running_motor_locks_parameters_that_need_standstill() -> None:
    async with editing("atv71") as (made, editor):
        made.commander.refer("20Hz")
        await made.done()
        await made.order("forward")
        await read(made, editor, "TFR", "ACC")
        await made.until(lambda: editor.state == "running")
        refused = editor.refusal("TFR")
        assert refused is not None
        assert refused.reason == "running"
        assert editor.refusal("ACC") is None
        editor.staging.stage("TFR", "65")
        editor.staging.stage("ACC", "4")
        editor.apply()
        assert "Nothing written. 2 still staged" in await written(made, editor)
        # a question comes before the rest is written
        assert editor.applied is not None
        assert editor.applied.waits == ("ACC",)
        assert made.drive.raw("ACC") == 30
        made.session.work.outcome = None
        editor.apply(editor.applied.waits)
        assert "Wrote 1, all verified" in await written(made, editor)
        assert made.drive.raw("ACC") == 40
        assert "TFR" in editor.staging.edits
        assert made.drive.raw("TFR") == 600


async def test_foreign_change_is_detected_and_not_overwritten() -> None:
    async with editing("atv71") as (made, editor):
        await read(made, editor, "ACC")
        editor.staging.stage("ACC", "7")
        made.drive.set("ACC", 55)
        await made.until(lambda: "ACC" in editor.staging.changed_elsewhere)
        editor.apply()
        assert "still staged" in await written(made, editor)
        assert made.drive.raw("ACC") == 55
        made.session.work.outcome = None
        editor.staging.accept_changes()
        editor.apply()
        assert "Wrote 1" in await written(made, editor)
        assert made.drive.raw("ACC") == 70


async def test_ramp_keeps_its_seconds_if_its_increment_changes() -> None:
    async with editing("atv71") as (made, editor):
        await read(made, editor, "ACC", "INR")
        editor.staging.stage("ACC", "7.5")
        editor.staging.stage("INR", "0.01 s")
        editor.apply()
        await written(made, editor)
        assert (made.drive.raw("INR"), made.drive.raw("ACC")) == (0, 750)
        assert editor.values.value_of("ACC", 750).display == "7.50 s"
        held = editor.values.held("ACC")
        assert held is not None
        assert reading_of(held).value == editor.values.value_of("ACC", 750)


async def test_unverified_parameter_is_confirmed_once() -> None:
    async with editing("atv21") as (made, editor):
        await read(made, editor, "F112")
        refused = editor.refusal("F112")
        assert refused is not None
        assert refused.reason == "unverified"
        editor.confirm("F112")
        assert editor.refusal("F112") is None
        again = Editor(editor.session, editor.journal, editor.watched)
        assert again.refusal("F112") is None or again.refusal("F112").reason != "unverified"  # type: ignore[union-attr]


async def test_nothing_is_staged_while_something_is_written() -> None:
    async with editing("atv71") as (made, editor):
        await read(made, editor, "ACC", "DEC")
        editor.staging.stage("ACC", "7.5")
        editor.apply()
        if editor.busy:
            with pytest.raises(ValueRefused, match="Wait"):
                editor.staging.stage("DEC", "5")
        await written(made, editor)
        editor.staging.stage("DEC", "5")


async def test_settings_are_saved_and_reset_to_factory() -> None:
    async with editing("atv312") as (made, editor):
        await read(made, editor, "ACC")
        editor.staging.stage("ACC", "9")
        editor.apply()
        await written(made, editor)
        assert editor.unsaved == {"ACC"}
        made.session.work.outcome = None
        editor.save()
        assert "saved" in await written(made, editor)
        assert editor.unsaved == set()
        made.session.work.outcome = None
        editor.factory()
        assert "factory settings are restored" in await written(made, editor)


async def test_set_is_compared_and_staged(tmp_path: Path) -> None:
    async with editing("atv71") as (made, editor):
        session = made.session
        upload = Upload(session, ["ACC", "DEC", "HSP", "INR"])
        await upload.run()
        file = tmp_path / "set.toml"
        write_file(file, dump_set(session.profile, upload.parameter_set()))
        made.drive.set("ACC", 99)
        made.drive.set("HSP", 400)
        editor.source = read_set(file)
        editor.other = dict(editor.source.raws)
        await read(made, editor, "ACC", "DEC", "HSP", "INR")
        image = made.session.image
        await made.until(lambda: (image.raws["ACC"], image.raws["HSP"]) == (99, 400))
        assert set(rows(editor.facts, "differs")) == {"ACC", "HSP"}
        editor.staging.take_plan(await editor.plan())
        assert {edit.code for edit in editor.staging.edits} == {"ACC", "HSP"}
        editor.apply()
        assert "Wrote 2" in await written(made, editor)
        assert (made.drive.raw("ACC"), made.drive.raw("HSP")) == (30, 500)


async def test_equal_value_of_set_is_not_staged_by_later_change(tmp_path: Path) -> None:
    async with editing("atv71") as (made, editor):
        session = made.session
        upload = Upload(session, ["ACC", "DEC", "LSP", "INR"])
        await upload.run()
        file = tmp_path / "set.toml"
        write_file(file, dump_set(session.profile, upload.parameter_set()))
        made.drive.set("ACC", 99)
        editor.source = read_set(file)
        await read(made, editor, "ACC", "DEC", "LSP", "INR")
        await made.until(lambda: made.session.image.raws["ACC"] == 99)
        editor.staging.take_plan(await editor.plan())
        editor.apply()
        assert "Wrote 1" in await written(made, editor)
        made.drive.set("DEC", 77)  # at the keypad
        await made.until(lambda: made.session.image.raws["DEC"] == 77)
        editor.staging.stage("LSP", "2 Hz")
        made.session.work.outcome = None
        editor.apply()
        assert "Wrote 1" in await written(made, editor)
        assert list(editor.staging.edits) == []
        assert made.drive.raw("DEC") == 77


async def test_change_that_needs_reset_is_reported_until_power_off() -> None:
    # a line that does not wait long for late replies: how long it does is not the matter here
    timing = Timing(first_timeout=0.3, late_reply=0.3)
    async with editing("atv21", timing=timing) as (made, editor):
        await read(made, editor, "F875")
        editor.staging.stage_raw("F875", 2)
        editor.apply()
        assert "after a reset of the drive: F875" in await written(made, editor)
        assert editor.waits_for_reset == {"F875"}
        editor.values.visible = ("F875",)
        made.drive.power_off()
        await made.let_go_until(lambda: "did not answer" in editor.values.trouble)
        made.clock.advance(WAS_OFF)
        assert editor.waits_for_reset == {"F875"}
        made.drive.power_on()
        await made.let_go_until(lambda: editor.waits_for_reset == set())


async def write(made: Bench, editor: Editor, code: str, text: str) -> None:
    """Stage one value, write it, and wait for it."""
    await read(made, editor, code)
    editor.staging.stage(code, text)
    made.session.work.outcome = None
    editor.apply()
    assert "Wrote 1" in await written(made, editor)


async def test_setting_restored_to_its_saved_value_counts_as_saved() -> None:
    async with editing("atv71") as (made, editor):
        await write(made, editor, "ACC", "7.5 s")
        await write(made, editor, "DEC", "8 s")
        assert editor.unsaved == {"ACC", "DEC"}
        await write(made, editor, "ACC", "3 s")
        assert editor.unsaved == {"DEC"}
        # what is saved from now on is the value at the saving
        made.session.work.outcome = None
        editor.save()
        assert "saved" in await written(made, editor)
        await write(made, editor, "DEC", "3 s")
        assert editor.unsaved == {"DEC"}
        await write(made, editor, "DEC", "8 s")
        assert editor.unsaved == set()


async def test_old_values_are_staged_again_after_they_were_unstaged() -> None:
    async with editing("atv71") as (made, editor):
        await write(made, editor, "INR", "0.01 s")
        await write(made, editor, "INR", "0.1 s")
        await read(made, editor, "ACC", "DEC")
        staging = editor.staging
        staging.stage("ACC", "7.5 s")
        staging.stage("DEC", "8 s")
        made.session.work.outcome = None
        editor.apply()
        assert "Wrote 2" in await written(made, editor)
        for _ in range(2):  # those of the last write: INR is left alone
            assert staging.stage_old() == "2 old values are staged."
            assert {(edit.code, edit.new) for edit in staging.edits} == {("ACC", 30), ("DEC", 30)}
            staging.undo("DEC")
            staging.undo("ACC")
            assert len(staging.edits) == 0
        staging.stage_old()
        staging.undo_all()
        assert staging.stage_old() == "2 old values are staged."
        # a value that the drive holds again is not an old one
        made.drive.set("DEC", 30)
        await made.until(lambda: made.session.image.raws["DEC"] == 30)
        staging.undo_all()
        assert staging.stage_old() == "1 old value is staged."


async def test_setting_changed_by_another_source_counts_as_unsaved() -> None:
    async with editing("atv71") as (made, editor):
        await write(made, editor, "ACC", "7.5 s")
        made.drive.set("ACC", 55)  # at the keypad, which may have saved it
        await made.until(lambda: made.session.image.raws["ACC"] == 55)
        await write(made, editor, "ACC", "3 s")
        assert editor.unsaved == {"ACC"}


async def test_no_value_is_known_as_saved_after_a_factory_reset() -> None:
    async with editing("atv71") as (made, editor):
        await write(made, editor, "DEC", "8 s")
        await write(made, editor, "DEC", "3 s")
        assert editor.unsaved == set()
        made.session.work.outcome = None
        editor.factory()
        await written(made, editor)
        await write(made, editor, "ACC", "7.5 s")
        await write(made, editor, "ACC", "3 s")
        assert "ACC" in editor.unsaved


async def test_family_that_saves_each_write_has_nothing_unsaved() -> None:
    async with editing("atv21") as (made, editor):
        await write(made, editor, "ACC", "7.5 s")
        assert editor.unsaved == set()


@pytest.mark.parametrize(
    ("after", "trouble", "quality"),
    [
        (8.0, "", Quality.GOOD),
        (12.0, "", Quality.STALE),
        (0.5, "No answer from device 1.", Quality.STALE),
    ],
    ids=["current", "not read again", "cannot be read"],
)
def test_held_value_is_old_if_it_is_not_read_again(
    after: float, trouble: str, quality: Quality
) -> None:
    clock = FakeClock()
    session = DriveSession(FakeLine({1: {}}), 1, library.load("atv71"), clock=clock)
    values = WatchedValues(session, lambda: None, lambda: None)
    assert values.held("HSP") is None
    session.image.confirm("HSP", 500, clock.monotonic())
    clock.advance(after)
    values.trouble = trouble
    held = values.held("HSP")
    assert held is not None
    assert held.quality is quality
    drawn = held.drawn(
        clock.monotonic(),
        current=lambda value: value.display,
        old=lambda value, age: f"{value.display}, {age:.1f}",
        missing="",
    )
    assert drawn == ("50.0 Hz" if quality is Quality.GOOD else f"50.0 Hz, {after:.1f}")
