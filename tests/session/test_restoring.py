"""Parameter sets taken from simulated drives and brought back, whatever happens on the way."""

from __future__ import annotations

import asyncio

import pytest

from tests.session.sets_bench import FAMILIES, Bench, bench
from tests.sweeps import kept
from tui.bus.errors import RequestRefused
from tui.drive.profile import library
from tui.drive.profile.profile import is_verified
from tui.drive.settings.compare import Side, compare_settings, side_of
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.drive.settings.restore_plan import NO_OPTIONS, Held, Options, RestorePlan
from tui.drive.settings.restore_planner import plan_restore
from tui.drive.settings.set_file import load_set
from tui.drive.settings.writable import is_setting, line_setting
from tui.drive.values import raw_range
from tui.session.connect.identify import identify_drive
from tui.session.read.upload import Upload
from tui.session.settings.applied import EditOutcome, Result
from tui.session.settings.eeprom import factory_reset
from tui.session.settings.restore import Mark, Restored, plan_for, restore_set

ATV71, ATV312, ATV31 = (library.load(p) for p in ("atv71", "atv312", "atv31"))

SETS = {
    "atv21": {"F803": 7, "ACC": 88, "UL": 4500, "F875": 3, "F876": 4},
    "atv31": {"ACC": 88, "HSP": 450, "LSP": 100, "tFr": 700, "Inr": 0, "SP2": 333, "LAC": 2,
              "Fr1": 164, "Cd1": 10, "CHCF": 2, "ttO": 33, "ItH": 90},
    "atv312": {"ACC": 88, "HSP": 450, "LSP": 100, "tFr": 700, "Inr": 2, "SP2": 333, "LAC": 2,
               "ttO": 33},
    "atv71": {"ACC": 88, "HSP": 450, "LSP": 100, "TFR": 700, "INR": 0, "SP2": 333, "TTO": 33,
              "NMA1": 3201, "NMA2": 3202, "FRY": 1},
    "powerdrive": {"15.07": 77, "6.43": 1, "11.63": 30},
    "proxidrive": {"15.07": 77, "11.63": 30, "6.43": 1},
    "varmeca": {"15.07": 77, "6.43": 1},
}  # fmt: skip


def known(family: str) -> dict[str, int]:
    """The settings of a test by the codes of the profile, whose letters may be large or small."""
    profile = library.load(family)
    return {profile.find(code).code: raw for code, raw in SETS[family].items()}


def all_unverified(family: str) -> Options:
    codes = {p.code for p in library.load(family).parameters if not is_verified(p)}
    return Options(confirmed=frozenset(codes))


async def backed_up(made: Bench) -> ParameterSet:
    """The drive's parameter set, through its text."""
    upload = Upload(made.session)
    await upload.run()
    text = dump_set(made.profile, upload.parameter_set())
    return load_set(text, "set.toml", library.load)


async def to_factory(made: Bench) -> None:
    """Factory settings, by the line where the family's order is known, else at the keypad."""
    if made.profile.data.memory.factory is not None:
        await factory_reset(made.session, made.journal, made.permit(), confirmed={"CMI"})
        return
    line = {s.parameter for s in made.profile.data.link.settings}
    made.drive.registers.to_factory(frozenset(line))


def skipped(plan: RestorePlan) -> dict[str, str]:
    return {item.code: item.reason for item in plan.items_of_kind("skip")}


async def restored(made: Bench, values: ParameterSet, options: Options) -> Restored:
    source = library.load(values.head.profile)
    return await restore_set(
        made.session, made.journal, values, source, options, permit=made.permit()
    )


@pytest.mark.parametrize("family", kept(FAMILIES, "atv21", "powerdrive"))
@pytest.mark.sweep
async def test_restore_after_a_factory_reset_equals_the_backup(family: str) -> None:
    with bench(family, sets=known(family)) as made:
        values = await backed_up(made)
        await to_factory(made)
        lost = compare_settings(
            made.profile, side_of("file", values), side_of("now", await backed_up(made))
        )
        assert lost, "the factory settings changed nothing: this test would prove nothing"
        done = await restored(made, values, all_unverified(family))
        assert done.complete, [result.text for result in done.results if not result.done]
        now = await backed_up(made)
        left = compare_settings(made.profile, side_of("file", values), side_of("now", now))
        assert {row.code for row in left} <= set(skipped(done.plan))
        reasons = {skipped(done.plan)[row.code] for row in left}
        assert reasons <= {"forbidden", "range"}
        for code, raw in known(family).items():
            if code not in skipped(done.plan) and not line_setting(made.profile, code):
                assert made.drive.raw(code) == raw, code
        again = await plan_for(made.session, values, made.profile, all_unverified(family))
        assert len(again.edits) == 0
        assert not Mark.of(made.session).path.exists()


@pytest.mark.parametrize("family", kept(["atv21", "atv312", "atv71"], "atv312"))
async def test_killed_restore_is_resumed(family: str) -> None:
    with bench(family, sets=known(family)) as made:
        values = await backed_up(made)
        await to_factory(made)
        options = all_unverified(family)
        half = asyncio.Event()

        def progress(done: int, of: int, result: Result) -> None:
            if done >= max(1, of // 2):
                half.set()

        work = asyncio.create_task(
            restore_set(
                made.session,
                made.journal,
                values,
                made.profile,
                options,
                permit=made.permit(),
                progress=progress,
            )
        )
        await half.wait()
        work.cancel()
        with pytest.raises(asyncio.CancelledError):
            await work
        left = await plan_for(made.session, values, made.profile, options)
        assert len(left.edits) > 0
        assert "did not finish" in Mark.of(made.session).interrupted
        before = len(made.writes())
        done = await restored(made, values, options)
        assert done.complete
        assert Mark.of(made.session).interrupted == ""
        # what was written before the kill is not written again, but for what others change
        assert len(made.writes()) - before <= len(left.edits) + len(done.results)


@pytest.mark.sweep
async def test_lost_line_keeps_the_rest_and_the_resume_mark() -> None:
    with bench("atv71", sets=known("atv71")) as made:
        values = await backed_up(made)
        await to_factory(made)

        def progress(done: int, of: int, result: Result) -> None:
            if done == 2:
                made.lose_line()

        done = await restore_set(
            made.session,
            made.journal,
            values,
            made.profile,
            permit=made.permit(),
            progress=progress,
        )
        assert done.stopped
        assert not done.complete
        assert len(done.left) > 0
        assert Mark.of(made.session).interrupted
        made.regain_line()
        again = await restored(made, values, Options())
        assert again.complete, again


async def test_line_lost_between_passes_keeps_the_results() -> None:
    with bench("atv312", sets=known("atv312")) as made:
        values = await backed_up(made)
        await to_factory(made)
        looked: list[int] = []

        def reading(done: int, of: int) -> None:
            looked.append(done)
            if looked.count(of) == 1 and done < of:
                made.lose_line()

        done = await restore_set(
            made.session,
            made.journal,
            values,
            made.profile,
            permit=made.permit(),
            reading=reading,
        )
        assert done.stopped
        assert done.unseen == done.stopped
        assert any(result.done for result in done.results)
        assert Mark.of(made.session).interrupted
        made.regain_line()
        assert (await restored(made, values, NO_OPTIONS)).complete


async def test_read_only_line_is_not_restored() -> None:
    with bench("atv71", read_only=True) as made:
        with pytest.raises(RequestRefused, match="read-only"):
            await restored(made, values_of("atv71", {"ACC": 50}), NO_OPTIONS)
        assert not Mark.of(made.session).path.exists()


async def test_equal_drive_is_not_written() -> None:
    with bench("atv312", sets=known("atv312")) as made:
        values = await backed_up(made)
        done = await restored(made, values, Options())
        assert done.complete
        assert made.writes() == []


async def test_running_motor_gets_writable_settings_and_reports_the_rest() -> None:
    with bench("atv312", sets=known("atv312")) as made:
        values = await backed_up(made)
        for code, raw in (("ACC", 5), ("FrS", 600), ("UnS", 230)):
            made.drive.set(code, raw)
        made.drive.run(20.0)
        done = await restored(made, values, Options())
        outcomes = {result.edit.code: result.outcome for result in done.results}
        assert outcomes["ACC"] is EditOutcome.DONE
        assert outcomes["FrS"] is EditOutcome.REFUSED
        assert {edit.code for edit in done.left} >= {"FrS"}
        assert done.plan.needs_stop
        assert not done.complete


def values_of(family: str, raws: dict[str, int], **identity: str) -> ParameterSet:
    return ParameterSet(SetHead(family, identity=identity), raws)


def plan(
    family: str,
    now: dict[str, int],
    values: ParameterSet,
    options: Options = NO_OPTIONS,
    **held: str,
) -> RestorePlan:
    profile = library.load(family)
    source = library.load(values.head.profile)
    return plan_restore(
        profile, Held(now, reference=held.get("reference", "")), values, source, options
    )


NOW = {"INR": 1, "ACC": 30, "HSP": 500, "LSP": 0, "TFR": 600, "NCR": 40, "UNS": 400, "ADD": 1,
       "TBR": 32, "FRY": 0, "PAN0": 1, "CMD": 0, "RFR": 0}  # fmt: skip


def test_omitted_settings_have_reasons() -> None:
    values = ParameterSet(
        SetHead("atv71"),
        {**NOW, "ACC": 50, "ADD": 9, "TBR": 28, "FRY": 3, "CMD": 15, "RFR": 99, "DEC": 4},
        {"AC2": "refused"},
        {"XYZ": "7"},
    )
    found = plan("atv71", NOW, values)
    assert [edit.code for edit in found.edits] == ["ACC"]
    assert skipped(found) == {
        "ADD": "line", "TBR": "line", "FRY": "forbidden", "CMD": "no setting",
        "RFR": "no setting", "DEC": "absent", "AC2": "absent", "XYZ": "unknown",
    }  # fmt: skip
    requested = plan("atv71", NOW, values, Options(line_settings=True))
    assert {edit.code for edit in requested.edits} == {"ACC", "ADD", "TBR"}
    assert found.count("equal") == 7
    assert found.count("skip") == 6


def test_values_beyond_ranges_and_limits_are_not_written() -> None:
    found = plan("atv71", NOW, values_of("atv71", {"TTO": 9999, "CHCF": 99}))
    assert skipped(found) == {"TTO": "absent", "CHCF": "absent"}
    now = {**NOW, "TTO": 100, "CHCF": 1}
    found = plan("atv71", now, values_of("atv71", {"TTO": 9999, "CHCF": 99, "LSP": 550}))
    assert skipped(found) == {"TTO": "range", "CHCF": "range", "LSP": "range"}
    assert len(found.edits) == 0


def test_drive_with_another_rating_keeps_its_motor_data() -> None:
    values = values_of("atv71", {**NOW, "NCR": 99, "UNS": 230, "ACC": 60}, reference="ATV71HU15N4")
    same = plan("atv71", NOW, values, reference="ATV71HU15N4")
    assert same.same_rating is True
    assert {edit.code for edit in same.edits} == {"NCR", "UNS", "ACC"}
    other = plan("atv71", NOW, values, reference="ATV71HU22N4")
    assert other.same_rating is False
    assert {edit.code for edit in other.edits} == {"ACC"}
    assert skipped(other)["NCR"] == skipped(other)["UNS"] == "rating"
    taken = plan("atv71", NOW, values, Options(rating=True), reference="ATV71HU22N4")
    assert {edit.code for edit in taken.edits} == {"NCR", "UNS", "ACC"}
    assert plan("atv71", NOW, values).same_rating is None


def test_models_are_compared_by_their_model_word_too() -> None:
    values = values_of("atv21", {"FB05": 20, "F803": 5})
    assert plan("atv21", {"FB05": 20, "F803": 3}, values).same_rating is True
    assert plan("atv21", {"FB05": 24, "F803": 3}, values).same_rating is False


def test_unverified_parameters_wait_for_confirmation() -> None:
    values = values_of("atv21", {"F111": 48})
    assert skipped(plan("atv21", {"F111": 38}, values)) == {"F111": "unverified"}
    confirmed = plan("atv21", {"F111": 38}, values, Options(confirmed=frozenset({"F111"})))
    assert [edit.code for edit in confirmed.edits] == ["F111"]


def test_ramp_is_restored_in_seconds_whatever_the_scale() -> None:
    values = values_of("atv312", {"Inr": 0, "ACC": 300})
    both = plan("atv312", {"Inr": 1, "ACC": 10}, values)
    assert [(e.code, e.new, e.text) for e in both.edits] == [
        ("Inr", 0, "0.01 s"),
        ("ACC", 300, "3.00 s"),
    ]
    # a drive that has no ramp increment counts in tenths
    profile = library.load("atv31")
    held = Held({"ACC": 10}, lacking={"Inr"})
    old = plan_restore(profile, held, values_of("atv31", {"Inr": 0, "ACC": 300}), profile)
    assert [(e.code, e.new, e.text) for e in old.edits] == [("ACC", 30, "3.0 s")]


def test_common_quantities_are_converted_between_families() -> None:
    values = values_of(
        "atv71",
        {"INR": 0, "ACC": 314, "DEC": 300, "HSP": 450, "LSP": 0, "TFR": 600, "ADD": 9, "TTO": 50,
         "UNS": 400, "CTT": 1, "SP2": 123},
    )  # fmt: skip
    now = {"Inr": 1, "ACC": 30, "dEC": 30, "HSP": 500, "LSP": 0, "tFr": 600, "UnS": 230, "SP2": 100}
    found = plan("atv312", now, values)
    assert found.across
    assert {e.code: e.text for e in found.edits} == {
        "ACC": "3.1 s", "HSP": "45.0 Hz", "SP2": "12.3 Hz",
    }  # fmt: skip
    reported = {item.code: item for item in found.items}
    assert reported["ACC"].text == "ACC: 3.14 s is rounded to 3.1 s."
    assert reported["dEC"].kind == "equal"
    assert reported["UnS"].reason == "rating"
    assert reported["atv71 CTT"].reason == reported["atv71 ADD"].reason == "no counterpart"
    taken = plan("atv312", now, values, Options(rating=True))
    assert "UnS" in taken.edits


async def test_set_of_another_family_is_restored_by_quantity() -> None:
    with bench("atv71", sets={"ACC": 77, "HSP": 420, "SP3": 222}) as made:
        values = await backed_up(made)
    with bench("atv312") as made:
        made.session.identity = await identify_drive(made.session.line, 1)
        done = await restored(made, values, Options())
        assert done.complete, done.results
        assert (made.drive.raw("ACC"), made.drive.raw("HSP"), made.drive.raw("SP3")) == (
            77,
            420,
            222,
        )


@pytest.mark.parametrize("family", FAMILIES)
def test_plan_never_writes_commands_or_forbidden_parameters(family: str) -> None:
    """Even if a file holds another value for every single parameter."""
    profile = library.load(family)
    now = {p.code: 0 for p in profile.parameters}
    raws = {p.code: max(raw_range(p)[0], 1) for p in profile.parameters}
    options = Options(True, True, frozenset(now))
    values = ParameterSet(SetHead(family), raws)
    found = plan_restore(profile, Held(now), values, profile, options)
    for edit in found.edits:
        parameter = profile[edit.code]
        assert is_setting(profile, parameter)
        assert not parameter.forbidden
    assert compare_settings(profile, Side("a", now), Side("b", now)) == []
