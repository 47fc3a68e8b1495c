"""Applying edits to simulated drives: written once, read back, never over a foreign change."""

from __future__ import annotations

import asyncio
import re
import time

import pytest

from tests.session.sets_bench import Bench, bench
from tui.bus.errors import OUTCOME_UNKNOWN, DeviceException, LineLost, NoAnswer, RequestRefused
from tui.cli.shared.errors import LINE_TROUBLE, REFUSED_HERE
from tui.cli.shared.say import Messages
from tui.cli.shared.sets import ResultTelling, status_of_results
from tui.drive.settings.memory_orders import MemoryRefused
from tui.session.read import retrying_reader
from tui.session.settings import eeprom
from tui.session.settings.applied import Applied, EditOutcome, Result, done_text
from tui.session.settings.apply import apply_edits
from tui.session.settings.eeprom import factory_reset, save_to_eeprom
from tui.simulator import FaultRates


def outcomes(applied: Applied) -> dict[str, EditOutcome]:
    return {result.edit.code: result.outcome for result in applied.results}


def text(applied: Applied, code: str) -> str:
    return next(result.text for result in applied.results if result.edit.code == code)


async def test_edits_are_written_verified_and_recorded() -> None:
    with bench("atv71") as made:
        reported: list[tuple[int, int, str]] = []

        def progress(done: int, of: int, result: Result) -> None:
            reported.append((done, of, result.text))

        edits = await made.stage(ACC="5 s", DEC="7,25")
        applied = await made.write(edits, progress=progress)
        assert outcomes(applied) == {"ACC": EditOutcome.DONE, "DEC": EditOutcome.DONE}
        assert (made.drive.raw("ACC"), made.drive.raw("DEC")) == (50, 73)
        assert reported == [(1, 2, "ACC: 3.0 s -> 5.0 s"), (2, 2, "DEC: 3.0 s -> 7.3 s")]
        assert len(applied.left) == 0
        assert applied.unsaved == ("ACC", "DEC")
        entries = made.journal.recent
        assert [(e.code, e.old, e.new, e.answer, e.read_back, e.why) for e in entries] == [
            ("ACC", "3.0 s", "5.0 s", "ok", 50, "setting"),
            ("DEC", "3.0 s", "7.3 s", "ok", 73, "setting"),
        ]


async def test_scale_and_ramp_are_written_together() -> None:
    with bench("atv312") as made:
        applied = await made.apply(ACC="2.55 s", Inr="0.01 s")
        assert outcomes(applied) == {"Inr": EditOutcome.DONE, "ACC": EditOutcome.DONE}
        assert made.drive.raw("ACC") == 255


async def test_limits_are_written_before_the_values_they_limit() -> None:
    with bench("atv71", sets={"TFR": 600, "HSP": 500, "LSP": 0}) as made:
        applied = await made.apply(LSP="70", HSP="75", TFR="80")
        assert all(result.done for result in applied.results), applied.results
        assert [made.drive.raw(c) for c in ("LSP", "HSP", "TFR")] == [700, 750, 800]


async def test_value_beyond_another_parameter_is_not_sent() -> None:
    with bench("atv71", sets={"HSP": 500}) as made:
        applied = await made.apply(LSP="55", ACC="4")
        assert outcomes(applied) == {"LSP": EditOutcome.REFUSED, "ACC": EditOutcome.DONE}
        assert "above HSP = 50.0 Hz" in text(applied, "LSP")
        assert "LSP" in applied.left
        assert 3105 not in [register for register, _ in made.writes()]


async def test_edits_that_depend_on_a_refused_one_are_held_back() -> None:
    """A limit that was to be raised first was not: values beyond it are not sent."""
    with bench("atv71", sets={"TFR": 600, "HSP": 500, "LSP": 0}) as made:
        edits = await made.stage(TFR="80", HSP="75", LSP="10", ACC="4 s")
        made.refuse("TFR")
        applied = await made.write(edits)
        assert outcomes(applied) == {
            "TFR": EditOutcome.DRIVE_REFUSED,
            "HSP": EditOutcome.HELD_BACK,
            "LSP": EditOutcome.DONE,
            "ACC": EditOutcome.DONE,
        }
        assert "it depends on TFR, which was not written" in text(applied, "HSP")
        assert {edit.code for edit in applied.left} == {"TFR", "HSP"}
        assert made.drive.raw("HSP") == 500


async def test_edits_scaled_by_a_refused_one_are_held_back() -> None:
    with bench("atv71", sets={"INR": 1, "ACC": 30}) as made:
        edits = await made.stage(INR="0.01", ACC="4.55 s")
        made.refuse("INR")
        applied = await made.write(edits)
        assert outcomes(applied) == {
            "INR": EditOutcome.DRIVE_REFUSED,
            "ACC": EditOutcome.HELD_BACK,
        }
        assert made.drive.raw("ACC") == 30


async def test_remaining_edits_wait_for_confirmation_after_a_failure() -> None:
    with bench("atv71", sets={"TFR": 600, "HSP": 500, "LSP": 0}) as made:
        edits = await made.stage(TFR="80", HSP="75", LSP="10", ACC="4 s")
        made.refuse("TFR")
        applied = await made.write(edits, ask_after_failure=True)
        assert set(applied.waits) == {"LSP", "ACC"}
        assert outcomes(applied)["HSP"] is EditOutcome.HELD_BACK
        assert applied.written == ()
        assert len(applied.left) == 4
        assert made.writes() == []


async def test_value_that_the_drive_already_holds_does_not_count_as_written() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s", DEC="7 s", HSP="40")
        made.drive.set("ACC", 50)
        applied = await made.write(edits)
        assert "already holds" in text(applied, "ACC")
        assert all(result.done for result in applied.results)
        assert done_text(applied.results) == "Wrote 2, all verified. Already held: 1."
        assert 9001 not in [register for register, _ in made.writes()]


async def test_change_by_another_source_is_not_overwritten() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s", DEC="7 s")
        made.drive.set("ACC", 90)
        applied = await made.write(edits)
        assert outcomes(applied) == {"ACC": EditOutcome.CHANGED, "DEC": EditOutcome.DONE}
        assert "from 3.0 s to 9.0 s" in text(applied, "ACC")
        assert made.drive.raw("ACC") == 90
        (left,) = applied.left
        assert (left.old, left.new) == (90, 50)
        again = await made.write(applied.left)
        assert outcomes(again) == {"ACC": EditOutcome.DONE}
        assert made.drive.raw("ACC") == 50


async def test_scale_changed_by_another_source_is_detected() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s")
        made.drive.set("INR", 0)
        applied = await made.write(edits)
        assert outcomes(applied) == {"ACC": EditOutcome.CHANGED}
        assert "INR, which sets its scale, has changed" in text(applied, "ACC")
        assert made.writes() == []
        (left,) = applied.left
        assert left.new == 500


async def test_unchanged_value_is_not_written() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s")
        made.drive.set("ACC", 50)
        applied = await made.write(edits)
        assert outcomes(applied) == {"ACC": EditOutcome.DONE}
        assert made.writes() == []


async def test_stopped_only_is_checked_against_the_current_state() -> None:
    with bench("atv312", run_hz=20.0) as made:
        applied = await made.apply(FrS="60", ACC="4")
        assert outcomes(applied) == {"FrS": EditOutcome.REFUSED, "ACC": EditOutcome.DONE}
        assert "with the motor stopped" in text(applied, "FrS")
        assert "FrS" in applied.left
        made.drive.halt()
        await rest(made)
        again = await made.write(applied.left)
        assert outcomes(again) == {"FrS": EditOutcome.DONE}


async def test_unverified_parameters_are_written_if_confirmed() -> None:
    with bench("atv21") as made:
        edits = await made.stage(F111="Forced local")
        refused = await made.write(edits)
        assert outcomes(refused) == {"F111": EditOutcome.REFUSED}
        assert "unverified" in text(refused, "F111")
        assert made.writes() == []
        done = await made.write(refused.left, confirmed={"F111"})
        assert outcomes(done) == {"F111": EditOutcome.DONE}


async def test_refusal_has_meaning_state_and_advice() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s", DEC="6 s")
        made.drive.busy = True
        applied = await made.write(edits)
        assert outcomes(applied) == {
            "ACC": EditOutcome.DRIVE_REFUSED,
            "DEC": EditOutcome.DRIVE_REFUSED,
        }
        reported = text(applied, "ACC")
        assert "exception 4, Not completed" in reported
        assert "The drive is ready" in reported or "The drive is not ready" in reported
        assert "Check if the parameter can be written" in reported
        assert {edit.code for edit in applied.left} == {"ACC", "DEC"}
        assert [e.answer.startswith("Device 1 refused") for e in made.journal.recent] == [
            True,
            True,
        ]


async def test_protected_parameter_is_not_written_without_reading() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s")
        made.drive.registers.protect([made.profile["ACC"]])
        applied = await made.write(edits)
        assert outcomes(applied) == {"ACC": EditOutcome.REFUSED}
        assert "cannot be read" in text(applied, "ACC")
        assert made.writes() == []


async def test_refusal_without_an_exception_is_found_by_reading_back() -> None:
    with bench("powerdrive") as made:
        edits = await made.stage(**{"15.07": "5"})
        made.drive.busy = True
        applied = await made.write(edits)
        assert outcomes(applied) == {"15.07": EditOutcome.NOT_TAKEN}
        assert "does not answer what it refuses" in text(applied, "15.07")
        assert "15.07" in applied.left


@pytest.mark.parametrize("family", ["powerdrive", "proxidrive", "varmeca"])
async def test_settings_of_another_option_module_are_not_written(family: str) -> None:
    """With another code in 15.01 the words of menu 15 mean something else."""
    with bench(family, sets={"15.01": 400}) as made:
        applied = await made.apply(**{"15.07": "5", "11.63": "4"})
        assert outcomes(applied) == {"15.07": EditOutcome.REFUSED, "11.63": EditOutcome.DONE}
        assert "another option is fitted" in text(applied, "15.07")
        assert made.drive.raw("15.07") == 0


async def test_lost_line_ends_writing_and_keeps_the_rest() -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s", DEC="6 s", AC2="7 s")

        def progress(done: int, of: int, result: Result) -> None:
            if done == 1:
                made.simulation.unplug()

        applied = await made.write(edits, progress=progress)
        first, *others = applied.results
        assert first.outcome is EditOutcome.DONE
        assert [result.outcome for result in others] == [EditOutcome.NOT_SENT] * 2
        assert applied.stopped
        assert {edit.code for edit in applied.left} == {r.edit.code for r in others}
        made.simulation.replug()


@pytest.mark.parametrize("taken", [True, False])
async def test_writing_continues_if_another_owner_takes_the_line(taken: bool) -> None:
    """The owner's end during a write ended a restore, although the line had a new owner."""
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s", DEC="6 s", AC2="7 s")
        ended = "The program that owned the line ended during the request."
        lost = LineLost(ended + OUTCOME_UNKNOWN)
        sent = made.lose_answer("DEC", lost, taken=taken)
        applied = await made.write(edits)
        was = EditOutcome.DONE if taken else EditOutcome.NOT_SENT
        assert outcomes(applied) == {
            "ACC": EditOutcome.DONE, "DEC": was, "AC2": EditOutcome.DONE,
        }  # fmt: skip
        assert len(sent) == 1
        if not taken:
            assert text(applied, "DEC") == f"DEC was not written: {ended}"
            assert status_of_results(applied.results) == LINE_TROUBLE


@pytest.mark.parametrize("end", ["a stop", "disarmed"])
async def test_blocked_line_ends_writing_and_keeps_the_rest(end: str) -> None:
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s", DEC="6 s", AC2="7 s")
        permit = made.permit()

        def ended() -> None:
            if end == "a stop":
                made.session.work.stop("F12")
            else:
                made.session.arming.disarm("Disarmed: no key pressed for 60 s.")

        made.after_writes(1, ended)
        applied = await apply_edits(made.session, made.journal, edits, permit=permit)
        assert [r.outcome for r in applied.results] == [
            EditOutcome.DONE, EditOutcome.NOT_SENT, EditOutcome.NOT_SENT,
        ]  # fmt: skip
        assert {edit.code for edit in applied.left} == {r.edit.code for r in applied.results[1:]}
        why = "a stop came after it (F12)" if end == "a stop" else "Disarmed"
        assert why in applied.stopped
        assert why in applied.results[1].text
        assert "Not sent: " not in applied.results[2].text
        assert [r.voided for r in applied.results] == [False, True, True]
        assert status_of_results(applied.results) == REFUSED_HERE
        telling = ResultTelling(Messages(as_json=True))
        for number, result in enumerate(applied.results, start=1):
            telling(number, 3, result)
        assert len(telling.messages.texts) == 3
        assert telling.messages.texts[-1] == f"The same of 1 more: {applied.results[2].edit.code}."
        assert len(made.writes()) == 1


async def test_lost_replies_neither_repeat_nor_drop_a_write() -> None:
    with bench("atv71", faults=FaultRates(lost=0.1)) as made:
        edits = await made.stage(ACC="5 s", DEC="6 s")
        applied = await made.write(edits)
        for result in applied.results:
            held = made.drive.raw(result.edit.code)
            assert result.done == (held == result.edit.new), result.text
        registers = [register for register, _ in made.writes()]
        assert len(registers) == len(set(registers))
        assert made.session.line.counters.timeouts > 0, "no reply was lost: nothing was shown"


async def test_read_only_line_writes_nothing() -> None:
    with bench("atv71", read_only=True) as made:
        edits = await made.stage(ACC="5 s")
        with pytest.raises(RequestRefused, match="read-only"):
            await made.write(edits)


async def test_silent_drive_ends_before_anything_is_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(retrying_reader, "READ_TRIES", 1)
    with bench("atv71") as made:
        edits = await made.stage(ACC="5 s")
        made.drive.power_off()
        with pytest.raises(NoAnswer):
            await made.write(edits)


# Line settings


async def test_address_that_changes_immediately_is_written_last() -> None:
    with bench("atv21", serial=True) as made:
        applied = await made.apply(F802="7", F803="5", F800="9600")
        assert [result.edit.code for result in applied.results] == ["F803", "F800", "F802"]
        assert outcomes(applied)["F802"] is EditOutcome.SENT
        assert made.drive.address == 7
        later, now = applied.links
        assert (later.code, later.at_once) == ("F800", False)
        assert ",9600," in later.line
        assert (now.code, now.at_once, now.device) == ("F802", True, 7)
        assert "-d 7" in now.text
        assert applied.after_reset == ("F800",)
        assert made.drive.raw("F803") == 5


async def test_no_request_goes_to_the_old_address_after_a_line_change() -> None:
    with bench("atv71") as made:
        applied = await made.apply(TBR="9600 bit/s", ADD="5", TTO="5")
        assert outcomes(applied) == {
            "TTO": EditOutcome.DONE, "TBR": EditOutcome.SENT, "ADD": EditOutcome.NOT_SENT,
        }  # fmt: skip
        assert "ADD" in applied.left
        assert applied.links[0].code == "TBR"
        assert made.drive.raw("TBR") == 28


# EEPROM and factory settings


@pytest.mark.parametrize("family", ["atv31", "atv312", "atv71"])
async def test_saved_settings_survive_a_power_off(family: str) -> None:
    with bench(family) as made:
        code = next(p.code for p in made.profile.parameters if p.quantity == "acceleration")
        await made.apply(**{code: "5 s"})
        made.drive.power_cycle()
        assert made.drive.raw(code) == 30
        await made.apply(**{code: "5 s"})
        assert "saved to EEPROM" in await save_to_eeprom(made.session, made.journal, made.permit())
        made.drive.power_cycle()
        assert made.drive.raw(code) == 50
        assert made.journal.recent[-1].why == "save to EEPROM"


@pytest.mark.parametrize("family", ["atv21", "powerdrive", "proxidrive", "varmeca"])
async def test_family_without_a_save_command_is_refused_with_a_reason(family: str) -> None:
    with bench(family) as made:
        with pytest.raises(MemoryRefused, match=r"have to save|keypad"):
            await save_to_eeprom(made.session, made.journal, made.permit())
        with pytest.raises(MemoryRefused, match="keypad"):
            await factory_reset(made.session, made.journal, made.permit(), confirmed={"CMI"})
        assert made.writes() == []


@pytest.mark.parametrize(("family", "confirmed"), [("atv31", {"CMI"}), ("atv312", set())])
async def test_factory_reset_restores_factory_settings(family: str, confirmed: set[str]) -> None:
    with bench(family, sets={"ACC": 99, "HSP": 400, "SP2": 333}) as made:
        reported = await factory_reset(
            made.session, made.journal, made.permit(), confirmed=confirmed
        )
        assert "restored in working memory" in reported
        assert re.search(r"Checked [1-9]\d* settings; all have their factory value\.", reported)
        factory = made.profile["SP2"].factory
        assert (made.drive.raw("ACC"), made.drive.raw("SP2")) == (30, factory)
        assert made.drive.raw("LAC") == 0
        made.drive.power_cycle()
        assert made.drive.raw("ACC") == 99


async def test_factory_values_that_are_not_known_are_not_reported_as_held(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(eeprom, "factory_raw", lambda *_: None)
    with bench("atv312") as made:
        reported = await factory_reset(made.session, made.journal, made.permit())
        assert "all have their factory value" not in reported
        assert re.search(r"Not checked: [1-9]\d* settings", reported)


async def test_unverified_command_needs_confirmation() -> None:
    with bench("atv31") as made:
        with pytest.raises(MemoryRefused, match="unverified"):
            await factory_reset(made.session, made.journal, made.permit())
        assert made.writes() == []


async def test_altivar_71_factory_reset_applies_to_selected_groups() -> None:
    with bench("atv71", sets={"ACC": 99}) as made:
        with pytest.raises(MemoryRefused, match="FRY selects no group"):
            await factory_reset(made.session, made.journal, made.permit())
        made.drive.set("FRY", 1)
        await factory_reset(made.session, made.journal, made.permit())
        assert made.drive.raw("ACC") == made.profile["ACC"].factory or made.drive.raw("ACC") == 30


@pytest.mark.parametrize("family", ["atv312", "atv71"])
async def test_save_and_factory_reset_need_a_stopped_motor(family: str) -> None:
    with bench(family, run_hz=20.0, sets={} if family == "atv312" else {"FRY": 1}) as made:
        for order in (save_to_eeprom, factory_reset):
            with pytest.raises(MemoryRefused, match="Stop the motor first"):
                await order(made.session, made.journal, made.permit())
        assert made.writes() == []


async def rest(made: Bench) -> None:
    end = time.monotonic() + 60
    while made.drive.motor.frequency:
        assert time.monotonic() < end, "the motor does not come to rest"
        await asyncio.sleep(0.05)


async def test_refused_save_has_its_reason() -> None:
    with bench("atv71") as made:
        made.drive.busy = True
        with pytest.raises(DeviceException, match="Check if the parameter can be written"):
            await save_to_eeprom(made.session, made.journal, made.permit())
