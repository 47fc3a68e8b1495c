"""Proof of the commands of a public profile on this site, by a test without a motor."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, cast

import msgspec
import pytest

from tests.session.sets_bench import Bench, bench
from tui.bus.fake import FakeLine
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.evidence import command_statement, evidence_text, with_evidence
from tui.drive.profile.profile import Profile, proof_text
from tui.drive.profile.schema import (
    EvidenceDrive,
    EvidenceFinding,
    EvidenceResult,
    ProfileData,
    ProfileEvidence,
)
from tui.drive.site_proof import is_proved_write, unproved_commands
from tui.session.acceptance.profile_test import command_findings, profile_test, with_reset
from tui.session.acceptance.result import AcceptanceResult, StepResult, StepResultKind
from tui.session.arming import NotArmed
from tui.session.drive import DriveSession
from tui.session.settings.write import Writer

MS300 = library.packaged_folder() / library.PUBLIC / "ms300.toml"
CHART = "command"
ALL = ("forward", "reverse", "stop", "reset")


@pytest.fixture
def public() -> Profile:
    """The profile as its file has it."""
    return library.load_file(MS300)


def evidence(
    profile: Profile,
    *commands: str,
    reference: bool = True,
    result: EvidenceResult = "confirmed",
    kind: Literal["drive", "simulated", "unknown"] = "drive",
) -> ProfileEvidence:
    """Evidence about commands and the reference of a profile."""
    statement = command_statement(profile.data)
    findings = [
        EvidenceFinding(subject="command", name=f"{CHART} {id}", statement=statement, result=result)
        for id in commands
    ]
    if reference:
        findings.append(
            EvidenceFinding(subject="reference", name="2001H", statement=statement, result=result)
        )
    return ProfileEvidence(
        profile=profile.id,
        program="1.0",
        date="2026-03-01T10:00:00+01:00",
        tested=EvidenceDrive(kind=kind, link="RTU 19200 8E1"),
        findings=findings,
    )


def proved(profile: Profile, *known: ProfileEvidence) -> Profile:
    return Profile(with_evidence(profile.data, known))


def test_commands_that_were_seen_to_work_are_proved_and_no_others(public: Profile) -> None:
    here = proved(public, evidence(public, "forward", "stop", reference=False))
    assert unproved_commands(here) == {"reverse", "reset", "2001H"}
    assert proof_text(here).endswith(" and 2 of its 4 commands")
    assert is_proved_write(here, here["2000H"], 0x0012)
    assert is_proved_write(here, here["2000H"], 0x0001)
    assert not is_proved_write(here, here["2000H"], 0x0022), "reverse"
    assert not is_proved_write(here, here["2002H"], 0x0002), "reset"
    assert not is_proved_write(here, here["2001H"], 100), "the reference"


@pytest.mark.parametrize("kind", ["simulated", "unknown"])
def test_simulated_drive_proves_no_command(
    public: Profile, kind: Literal["simulated", "unknown"]
) -> None:
    here = proved(public, evidence(public, *ALL, kind=kind))
    assert here.data is public.data or unproved_commands(here) == {*ALL, "2001H"}


def test_command_that_failed_later_is_not_proved(public: Profile) -> None:
    later = msgspec.structs.replace(
        evidence(public, "forward", reference=False, result="contradicted"),
        date="2026-04-01T10:00:00+01:00",
    )
    here = proved(public, evidence(public, *ALL), later)
    assert unproved_commands(here) == {"forward"}


def changed(data: ProfileData, change: str) -> ProfileData:
    """The profile with one fact changed on which a command depends."""
    [chart, *_], replace = data.charts, msgspec.structs.replace
    if change == "word":
        orders = [replace(o, words=[o.words[0] | 4]) for o in chart.orders]
        return replace(data, charts=[replace(chart, orders=orders)])
    if change == "state":
        return replace(data, charts=[replace(chart, states=chart.states[:-1])])
    field = {"address": 9999} if change == "address" else {"scale": "0.1"}
    rows = [replace(p, **field) if p.code == "2001H" else p for p in data.parameters]
    return replace(data, parameters=rows)


@pytest.mark.parametrize("change", ["word", "state", "address", "scale"])
def test_changed_profile_is_not_proved(public: Profile, change: str) -> None:
    known = evidence(public, *ALL)
    other = Profile(with_evidence(changed(public.data, change), [known]))
    assert unproved_commands(other) == {*ALL, "2001H"}


def test_certainty_of_a_fact_changes_no_proof(public: Profile) -> None:
    here = proved(public, evidence(public, *ALL))
    assert command_statement(here.data) == command_statement(public.data)
    assert unproved_commands(proved(here, evidence(public, *ALL))) == set()


def test_profile_file_cannot_claim_a_proved_command(tmp_path: Path) -> None:
    path = tmp_path / "ms300.toml"
    text = MS300.read_text("utf-8")
    path.write_text(text.replace('confidence = "public" }', 'confidence = "site" }'), "utf-8")
    assert any("command Stop: site is proved by evidence" in f for f in library.faults_of(path))


def test_drive_is_armed_without_a_question_once_all_commands_are_proved(public: Profile) -> None:
    session = DriveSession(FakeLine({1: {}}), 1, proved(public, evidence(public, *ALL)))
    assert session.is_unconfirmed
    session.arming.arm()
    some = DriveSession(FakeLine({1: {}}), 1, proved(public, evidence(public, "forward")))
    with pytest.raises(OrderRefused, match="values and 1 of its 4 commands"):
        some.arming.arm()


async def test_only_proved_words_are_written_without_a_person(public: Profile) -> None:
    with bench("ms300") as made:
        made.session.profile = proved(public, evidence(public, *ALL))
        made.session.bar_unconfirmed()
        writer = Writer(made.session, made.journal, made.permit())
        profile = made.session.profile
        await writer.write_parameter(profile["2000H"], 0x0012, why="run")
        for code, raw in (("2000H", 0x0032), ("01-00", 500)):
            with pytest.raises(NotArmed, match="is not proved on this site"):
                await writer.write_parameter(profile[code], raw, why="test")
        await Writer(made.session, made.journal, None).write_parameter(
            profile["2000H"], 0x0001, why="stop"
        )
        assert [word for _, word in made.writes()] == [0x0012, 0x0001]
        made.session.confirm_profile()
        await writer.write_parameter(profile["01-00"], 500, why="test")


# Findings of a test


def result(made: Bench, outcomes: Sequence[StepResultKind], **more: Any) -> AcceptanceResult:
    """The result of the test of a profile in fault, with these outcomes of its steps."""
    test = with_reset(profile_test(made.profile, MS300))
    steps = [StepResult(n, s, o) for n, (s, o) in enumerate(zip(test.steps, outcomes, strict=True))]
    fields = {"ended_by": "", "settings_hash": "a", "settings_after": "a", **more}
    return cast(AcceptanceResult, SimpleNamespace(steps=steps, **fields))


STEPS = 5  # reset, speeds, forward, reverse, stop


async def findings(outcomes: Sequence[StepResultKind], **more: Any) -> dict[str, EvidenceResult]:
    with bench("ms300") as made:
        await made.stage()
        found = command_findings(made.session, result(made, outcomes, **more))
        return {finding.name: finding.result for finding in found}


async def test_steps_that_passed_prove_their_commands() -> None:
    passed: list[StepResultKind] = ["passed"] * STEPS
    names = [f"{CHART} {id}" for id in ("reset", "forward", "reverse", "stop")]
    assert await findings(passed) == dict.fromkeys(["2001H", *names], "confirmed")


@pytest.mark.parametrize(
    ("outcomes", "more"),
    [
        (["passed"] * (STEPS - 1) + ["failed"], {}),
        (["passed"] * STEPS, {"ended_by": "stopped by another program"}),
        (["passed"] * STEPS, {"settings_after": ""}),
    ],
)
async def test_nothing_is_proved_without_a_stop_or_by_a_test_that_ended(
    outcomes: list[StepResultKind], more: dict[str, str]
) -> None:
    assert "confirmed" not in (await findings(outcomes, **more)).values()


async def test_evidence_in_the_folder_counts_at_the_next_start(
    public: Profile, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    library.evidence_folder().mkdir()
    path = library.evidence_folder() / "1.json"
    path.write_text(evidence_text(evidence(public, *ALL)), "utf-8")
    library.load.cache_clear()
    here = library.load("ms300")
    library.load.cache_clear()
    assert unproved_commands(here) == set()
    assert here["2000H"].confidence == here["2001H"].confidence == "site"
