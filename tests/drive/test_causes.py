"""Weighing of the causes of a fault: order, exclusion, support, and values that decide nothing."""

from __future__ import annotations

from decimal import Decimal
from itertools import product
from pathlib import Path

import pytest

from tests.drive.test_fault_help import FAMILIES, GOOD, own_drive
from tui.drive.causes import KnownValues, Verdict, is_measured, values_at_trip, weigh
from tui.drive.errors import ProfileError
from tui.drive.hints import advice, advice_now, codes_to_read
from tui.drive.profile import library
from tui.drive.profile.profile import is_verified
from tui.drive.profile.schema import CauseRule, FaultHelp, Hint, Multiple

ATV71 = library.load("atv71")


def fault_help(family: str, raw: int | None) -> FaultHelp:
    found = library.load(family).guide.fault(raw)
    assert found is not None
    return found


def verdicts(family: str, raw: int | None, known: KnownValues) -> dict[str, Verdict]:
    """Verdict of each cause, in the weighed order."""
    profile = library.load(family)
    return {c.text: c.verdict for c in weigh(profile, fault_help(family, raw), known)}


def test_supported_cause_precedes_and_excluded_cause_follows_the_others() -> None:
    hint = Hint(
        probable=["First", "Second", "Third", "Fourth"],
        ruled_out=[CauseRule(text="First", parameter="BRA", values=[1])],
        supported=[
            CauseRule(text="Third", parameter="DEC", at_most="1"),
            CauseRule(text="Fourth", parameter="DEC", at_most="1", weight=2),
        ],
    )
    known = KnownValues({"BRA": 1, "DEC": 5, "INR": 1})
    left = advice(ATV71, hint, known)
    assert [cause.text for cause in left.causes] == ["Fourth", "Third", "Second", "First"]
    assert left.probable == ("Fourth", "Third", "Second")
    assert left.causes[0].evidence[0].text == "DEC 0.5 s (up to 1 s)"
    assert [(row.text, row.reason) for row in left.excluded] == [("First", "ruled out, BRA Yes")]
    assert [row.text for row in left.supported] == ["Fourth", "Third"]


def test_exclusion_prevails_over_support() -> None:
    hint = Hint(
        probable=["First"],
        ruled_out=[CauseRule(text="First", parameter="BRA", values=[1])],
        supported=[CauseRule(text="First", parameter="BRA", values=[1])],
    )
    (cause,) = weigh(ATV71, hint, KnownValues({"BRA": 1}))
    assert (cause.verdict, cause.weight) == ("excluded", 0)


def test_unknown_value_decides_nothing_and_is_named() -> None:
    for known in (KnownValues(), KnownValues({"ULN": 2280}), KnownValues({"VCAL": 4})):
        causes = weigh(ATV71, fault_help("atv71", 19), known)
        assert {cause.verdict for cause in causes} == {"open"}
    (high, disturbed) = weigh(ATV71, fault_help("atv71", 19), KnownValues({"VCAL": 4}))
    assert (high.unknown, disturbed.unknown) == (("ULN",), ())


def test_unknown_scale_decides_nothing() -> None:
    ramp = "The braking is too sudden for the inertia"
    assert verdicts("atv71", 18, KnownValues({"DEC": 5}))[ramp] == "open"
    assert verdicts("atv71", 18, KnownValues({"DEC": 5, "INR": 1}))[ramp] == "supported"
    # 0.01 s per count: 5 is 0.05 s, 500 is 5 s
    assert verdicts("atv71", 18, KnownValues({"DEC": 500, "INR": 0}))[ramp] == "open"


def test_setting_written_after_the_trip_decides_nothing() -> None:
    raws = {"DEC": 5, "INR": 1}
    ramp = "The braking is too sudden for the inertia"
    assert verdicts("atv71", 18, KnownValues(raws))[ramp] == "supported"
    later = KnownValues(raws, changed=frozenset({"DEC"}))
    assert verdicts("atv71", 18, later)[ramp] == "open"


def test_value_at_the_trip_prevails_over_the_present_one() -> None:
    mains = "Mains voltage too high"
    now = {"ULN": 2280, "VCAL": 4}
    hint = fault_help("atv71", 19)
    (found,) = advice(ATV71, hint, KnownValues(now)).excluded
    assert (found.text, found.reason) == (mains, "not now, ULN 228.0 V (170 to 240 V)")
    high = advice(ATV71, hint, KnownValues(now, {"ULN": 2700}))
    assert high.excluded == ()
    assert high.supported[0].reason == "ULN 270.0 V (from 264 V) at the trip"
    (stored,) = advice_now(ATV71, hint, {**now, "ULP0": 2300}, present=True).excluded
    assert stored.reason == "ruled out, ULN 230.0 V (170 to 240 V) at the trip"


def test_current_at_standstill_does_not_exclude_an_overload() -> None:
    load = "Load too high for too long"
    raws = {"LCR": 0, "INV": 120}
    assert verdicts("atv71", 16, KnownValues(raws))[load] == "open"
    assert verdicts("atv71", 16, KnownValues(raws, {"LCR": 30}))[load] == "excluded"
    assert verdicts("atv71", 16, KnownValues(raws, {"LCR": 130}))[load] == "supported"


def test_stored_value_belongs_to_the_last_fault_only() -> None:
    raws = {"ULP0": 2280, "ULP1": 2900, "VCAL": 4}
    assert values_at_trip(ATV71, raws, 0, present=False)["ULN"] == 2280
    assert values_at_trip(ATV71, raws, 1, present=False)["ULN"] == 2900
    assert values_at_trip(ATV71, raws, None, present=False) == {}
    left = advice_now(ATV71, fault_help("atv71", 19), raws, present=False, latest=False)
    assert left.excluded == ()


def test_held_value_is_that_of_the_trip_only_while_in_fault() -> None:
    profile = library.load("atv21")
    load = "Drive current too high for too long"
    for present, excluded in ((True, (load,)), (False, ())):
        left = advice_now(profile, fault_help("atv21", 13), {"FE27": 20}, present=present)
        assert tuple(row.text for row in left.excluded) == excluded


def test_motor_overload_is_weighed_by_rated_currents() -> None:
    above, below, jammed, slow = fault_help("atv71", 17).probable
    raws = {"ITH": 60, "NCR": 80, "THT": 2, "FRS": 500, "THR": 40}
    trip = {"LCR": 84, "RFR": -450}
    found = verdicts("atv71", 17, KnownValues(raws, trip))
    assert list(found) == [below, above, jammed, slow]
    assert list(found.values()) == ["supported", "supported", "open", "excluded"]
    right = KnownValues({**raws, "ITH": 80, "THT": 1}, {"LCR": 50, "RFR": -450})
    assert set(verdicts("atv71", 17, right).values()) == {"excluded"}


def test_timeouts_that_are_off_exclude_a_communication_loss() -> None:
    for family in ("powerdrive", "proxidrive", "varmeca"):
        off = verdicts(family, None, KnownValues({"15.07": 0, "11.63": 0}))
        assert set(off.values()) == {"excluded"}
        active = verdicts(family, None, KnownValues({"15.07": 0, "11.63": 10}))
        assert set(active.values()) == {"open"}


def test_alarm_is_weighed_by_present_values() -> None:
    text = "Undervoltage alarm"
    hint = library.load("atv71").guide.alarm("LRS6", 8)
    assert hint is not None
    rule = CauseRule(text=text, parameter="LCR", at="trip", at_least="1")
    alarm = type(hint)(word="LRS6", bit=8, probable=[text], supported=[rule])
    (cause,) = advice_now(ATV71, alarm, {"LCR": 84}, present=False).causes
    assert cause.verdict == "supported"


def test_unverified_parameter_excludes_nothing() -> None:
    profile = library.load("atv21")
    assert not is_verified(profile["F301"])
    hint = Hint(probable=["x"], ruled_out=[CauseRule(text="x", parameter="F301", values=[4])])
    (cause,) = weigh(profile, hint, KnownValues({"F301": 4}))
    assert cause.verdict == "open"


@pytest.mark.parametrize("family", FAMILIES)
def test_rules_of_the_families_have_a_source_and_can_decide(family: str) -> None:
    profile = library.load(family)
    for hint in (*profile.guide.data.faults, *profile.guide.data.alarms):
        for rule in (*hint.ruled_out, *hint.supported):
            assert rule.source, (hint, rule.text)
            assert rule.weight == 1 or rule in hint.supported
        for rule in hint.ruled_out:
            assert all(is_verified(profile[code]) for code in rule.codes), rule
        for rule in (*hint.ruled_out, *hint.supported):
            if rule.at == "trip":
                known = {*values_at_trip(profile, dict.fromkeys(codes_to_read(profile, hint), 0), 0,
                                         present=True)}  # fmt: skip
                watched = {value.parameter for value in profile.data.monitoring.values}
                assert rule.parameter in known | watched, rule
                assert is_measured(profile, profile[rule.parameter])


@pytest.mark.parametrize("family", FAMILIES)
def test_no_value_both_excludes_and_supports_a_cause(family: str) -> None:
    profile = library.load(family)
    for hint in profile.guide.data.faults:
        for out, support in product(hint.ruled_out, hint.supported):
            same = ("text", "parameter", "when", "at")
            if any(getattr(out, key) != getattr(support, key) for key in same):
                continue
            assert not set(out.values) & set(support.values)
            for low, high in ((out, support), (support, out)):
                if low.at_most is not None and high.at_least is not None:
                    assert Decimal(low.at_most) < Decimal(high.at_least)
                    break
                if low.at_most_of is not None and high.at_least_of is not None:
                    assert Decimal(low.at_most_of.times) < Decimal(high.at_least_of.times)
                    break
            else:
                assert out.values or support.values, (out, support)


@pytest.mark.parametrize("family", FAMILIES)
def test_values_that_decide_are_read_with_what_scales_them(family: str) -> None:
    profile = library.load(family)
    for hint in profile.guide.data.faults:
        codes = set(codes_to_read(profile, hint))
        for rule in (*hint.ruled_out, *hint.supported):
            assert set(rule.codes) <= codes
            parameter = profile[rule.parameter]
            assert parameter.scale_by is None or parameter.scale_by.parameter in codes
    if family == "atv71":
        assert {"ULN", "ULP0", "VCAL", "BRA", "INR"} <= set(
            codes_to_read(profile, fault_help(family, 18))
        )


RULE = 'ruled_out = [{ text = "A jam", parameter = "%s", %s }]\n'
BROKEN_RULES = {
    "no such cause": (GOOD + RULE.replace("A jam", "x") % ("LCr", "values = [1]"), "'x' is not in"),
    "a check": (
        GOOD + 'check = ["See"]\n' + (RULE % ("LCr", "values = [1]")).replace("A jam", "See")
        .replace("ruled_out", "supported"), "'See' is not in probable.",
    ),
    "no parameter": (GOOD + RULE % ("NOSUCH", "values = [1]"), "no parameter 'NOSUCH'"),
    "no other parameter": (
        GOOD + RULE % ("LCr", 'at_most_of = { parameter = "NOSUCH", times = "1" }'),
        "no parameter 'NOSUCH'",
    ),
    "no condition": (GOOD + RULE % ("LCr", "min = 3"), "has no values and no limits"),
    "no unit": (GOOD + RULE % ("tUS", 'at_most = "1"'), "tUS has no unit"),
    "another unit": (
        GOOD + RULE % ("LCr", 'at_most_of = { parameter = "FrS", times = "1" }'),
        "LCr in A cannot be compared with FrS in Hz",
    ),
    "an empty range": (
        GOOD + RULE % ("LCr", 'at_least = "5", at_most = "4"'), "at_least 5 is above at_most 4",
    ),
    "an unknown time": (GOOD + RULE % ("LCr", 'at_most = "4", at = "noon"'), "noon"),
}  # fmt: skip


@pytest.mark.parametrize("case", BROKEN_RULES)
def test_invalid_rule_is_reported(case: str, tmp_path: Path) -> None:
    text, output = BROKEN_RULES[case]
    profile = library.load_file(own_drive(tmp_path, text))
    with pytest.raises(ProfileError, match=r"help/mine\.toml:\d+: ") as caught:
        _ = profile.guide.data
    assert output in str(caught.value)


def test_limit_of_an_unset_rating_decides_nothing() -> None:
    of = Multiple(parameter="NCR", times="1")
    hint = Hint(probable=["x"], supported=[CauseRule(text="x", parameter="ITH", at_least_of=of)])
    assert weigh(ATV71, hint, KnownValues({"ITH": 50, "NCR": 0}))[0].verdict == "open"
    assert weigh(ATV71, hint, KnownValues({"ITH": 50, "NCR": 50}))[0].verdict == "supported"
