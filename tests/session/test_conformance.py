"""Evidence about a profile: what a drive confirms, contradicts or leaves open, and its effect."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Literal, get_args

import msgspec
import pytest

from tests.session.sets_bench import Bench, bench
from tui.bus.fake import FakeLine
from tui.cli.derived import with_confirmed
from tui.drive.errors import ValueRefused
from tui.drive.family_page import SURENESS
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.evidence import (
    EvidenceError,
    all_evidence,
    evidence_text,
    read_evidence,
    statement_of,
    with_evidence,
)
from tui.drive.profile.example_frames import FramePair, example_frames_of
from tui.drive.profile.json_schema import schema_text
from tui.drive.profile.profile import is_verified, proof_text
from tui.drive.profile.schema import (
    Confidence,
    EvidenceDrive,
    EvidenceFinding,
    EvidenceResult,
    Parameter,
    ProfileEvidence,
)
from tui.screens.parameters.value_text import CONFIDENCE_WORDS
from tui.session.conformance import FROM_A_MANUAL, Conformance
from tui.session.drive import DriveSession

DOCS = Path(__file__).resolve().parents[2] / "docs"


async def answered(made: Bench, code: str, typed: str) -> EvidenceFinding:
    """The finding after a person has typed what the display shows."""
    test = Conformance(made.session)

    async def ask(_: Parameter) -> str:
        return typed

    finding = await test.compare_display(code, ask)
    assert test.findings == [finding]
    return finding


async def test_conformance_of_a_drive_reads_only_and_leaves_values_open() -> None:
    with bench("powerdrive") as made:
        made.drive.set("6.31", 7)
        test = Conformance(made.session)
        await test.run()
        found = {(f.subject, f.name): f for f in test.findings}
        assert found["address", "6.31"].result == "confirmed"
        assert found["range", "6.31"].result == "contradicted"
        frames = [f for f in test.findings if f.subject == "frame"]
        assert len(frames) == len(example_frames_of(made.profile))
        assert {f.result for f in frames} == {"confirmed"}
        assert not any(f.subject == "value" for f in test.findings)
        sent = {f.data[1] for f in made.session.line.trace if f.direction == "out"}
        assert sent <= {3, 43}


async def test_frame_with_a_reply_of_another_form_is_contradicted() -> None:
    with bench("atv312") as made:
        test, (first, second, *_) = Conformance(made.session), example_frames_of(made.profile)
        assert (await test.send_frame(first)).result == "confirmed"
        finding = await test.send_frame(FramePair(first.request, second.replies))
        assert (finding.result, finding.seen) == ("contradicted", "The drive gives 4 words.")
        assert (await test.send_frame(second)).seen == "Not sent: it writes."


@pytest.mark.parametrize(
    ("typed", "result"),
    [
        ("3.0", "confirmed"),
        ("3", "confirmed"),
        ("3,0 s", "confirmed"),
        ("30", "contradicted"),
        ("3.1", "contradicted"),
        ("3.0 Hz", "contradicted"),
        ("", "open"),
        ("-", "open"),
    ],
)
async def test_display_decides_about_the_value(typed: str, result: str) -> None:
    with bench("atv71") as made:
        assert (await answered(made, "ACC", typed)).result == result


async def test_questions_are_about_the_least_certain_values_that_were_read() -> None:
    with bench("atv71") as made:
        test = Conformance(made.session)
        for code in ("ULN", "HSP", "ACC", "TFR", "THD"):
            test.findings.append(EvidenceFinding(subject="address", name=code, result="confirmed"))
        codes = test.codes_to_ask()
        assert set(codes) == {"ULN", "HSP", "ACC", "TFR", "THD"}
        sure = [made.profile[code].confidence in FROM_A_MANUAL for code in codes]
        assert sure == sorted(sure)


async def test_display_that_shows_0_proves_nothing() -> None:
    with bench("atv71") as made:
        assert (await answered(made, "LSP", "0.0")).result == "open"
        assert (await answered(made, "LSP", "5.0")).result == "contradicted"
        with pytest.raises(ValueRefused):
            await answered(made, "ACC", "quick")


async def test_display_may_show_a_name_or_its_number() -> None:
    with bench("atv71") as made:
        made.drive.set("STT", 1)
        name = made.profile.names(made.profile["STT"])[1]
        assert (await answered(made, "STT", name.upper())).result == "confirmed"
        assert (await answered(made, "STT", "1")).result == "confirmed"
        assert (await answered(made, "STT", "0")).result == "contradicted"
        with pytest.raises(ValueRefused, match="not a value of STT"):
            await answered(made, "STT", "quickly")


def evidence(
    result: EvidenceResult,
    statement: str,
    kind: Literal["drive", "simulated", "unknown"] = "drive",
    date: str = "2026-03-01T10:00:00+01:00",
) -> ProfileEvidence:
    """Evidence about the unverified deceleration of an Altivar 21."""
    return ProfileEvidence(
        profile="atv21",
        program="1.0",
        date=date,
        tested=EvidenceDrive(
            reference="ATV21H075M3X", firmware="1.2", kind=kind, link="RTU 19200 8E1"
        ),
        findings=[EvidenceFinding(subject="value", name="dEC", statement=statement, result=result)],
    )


def judged_by(folder: Path, *known: ProfileEvidence) -> Parameter:
    """The deceleration of the profile with the evidence of a folder."""
    for number, each in enumerate(known):
        (folder / f"{number}.json").write_text(evidence_text(each))
    data = with_evidence(library.load("atv21").data, all_evidence(folder))
    return next(p for p in data.parameters if p.code == "dEC")


@pytest.fixture
def statement() -> str:
    """The statement about the deceleration, as a test writes it."""
    profile = library.load("atv21")
    assert not is_verified(profile["dEC"])
    return statement_of(profile["dEC"], profile.names(profile["dEC"]).items())


def test_evidence_of_a_real_drive_proves_a_parameter_on_this_site(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, statement: str
) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    library.evidence_folder().mkdir()
    by_file = judged_by(library.evidence_folder(), evidence("confirmed", statement))
    library.load.cache_clear()
    proved = library.load("atv21")["dEC"]
    library.load.cache_clear()
    assert proved == by_file
    assert proved.confidence == "site"
    assert is_verified(proved)
    assert proved.source.endswith("; confirmed on ATV21H075M3X 1.2, 2026-03-01")


def test_evidence_of_a_drive_of_another_family_proves_nothing(
    tmp_path: Path, statement: str
) -> None:
    stranger = evidence("confirmed", statement)
    stranger.findings.append(EvidenceFinding(subject="identity", name="", result="contradicted"))
    assert not is_verified(judged_by(tmp_path, stranger))


def test_evidence_lifts_an_unproved_profile_for_its_values_only(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path))
    library.evidence_folder().mkdir()
    high = library.load("atv320")["HSP"]
    known = msgspec.structs.replace(
        evidence("confirmed", statement_of(high, ())),
        profile="atv320",
        findings=[
            EvidenceFinding(
                subject="value", name="HSP", statement=statement_of(high, ()), result="confirmed"
            )
        ],
    )
    (library.evidence_folder() / "1.json").write_text(evidence_text(known))
    library.load.cache_clear()
    proved = library.load("atv320")
    library.load.cache_clear()
    assert [p.code for p in proved.parameters if p.confidence == "site"] == ["HSP"]
    assert proof_text(proved).startswith("this site has proved 1 of its ")
    session = DriveSession(FakeLine({1: {}}), 1, proved)
    with pytest.raises(OrderRefused, match=r"values and no command\. A wrong word may start"):
        session.arming.arm()


async def test_read_frame_of_a_profile_is_repeated() -> None:
    with bench("ms300") as made:
        read, written = example_frames_of(made.profile)
        test = Conformance(made.session)
        assert (await test.send_frame(read)).result == "confirmed"
        assert (await test.send_frame(written)).seen == "Not sent: it writes."


@pytest.mark.parametrize("kind", ["simulated", "unknown"])
def test_evidence_of_no_real_drive_proves_nothing(
    tmp_path: Path, statement: str, kind: Literal["simulated", "unknown"]
) -> None:
    assert not is_verified(judged_by(tmp_path, evidence("confirmed", statement, kind)))


def test_evidence_of_another_family_proves_nothing(tmp_path: Path, statement: str) -> None:
    other = msgspec.structs.replace(evidence("confirmed", statement), profile="atv71")
    assert not is_verified(judged_by(tmp_path, other))


def test_evidence_about_a_statement_that_has_changed_proves_nothing(
    tmp_path: Path, statement: str
) -> None:
    other = json.dumps([*json.loads(statement)[:1], 999, *json.loads(statement)[2:]])
    assert not is_verified(judged_by(tmp_path, evidence("confirmed", other)))


def test_newest_evidence_counts_and_damaged_files_are_ignored(
    tmp_path: Path, statement: str
) -> None:
    (tmp_path / "a.json").write_text("{")
    newer = evidence("contradicted", statement, date="2026-04-01T10:00:00+01:00")
    lost = judged_by(tmp_path, newer, evidence("confirmed", statement))
    assert lost.confidence == "unverified"
    assert "; contradicted on" in lost.source
    with pytest.raises(EvidenceError, match=r"a\.json: not evidence"):
        read_evidence(tmp_path / "a.json")


def test_profile_file_cannot_claim_to_be_proved_on_this_site(tmp_path: Path) -> None:
    text = (library.packaged_folder() / "atv21.toml").read_text("utf-8")
    path = tmp_path / "atv21.toml"
    head, row, rest = text.partition('code = "dEC"')
    claimed = re.sub('confidence = "[a-z]*"', 'confidence = "site"', rest, count=1)
    path.write_text(head + row + claimed)
    faults = library.faults_of(path)
    assert any("site is proved by evidence" in fault for fault in faults), faults


def test_page_of_confirmed_drives_is_up_to_date_and_counts_real_drives_only(
    tmp_path: Path,
) -> None:
    page = (DOCS / "confirmed.md").read_text("utf-8")
    assert page == with_confirmed(page, library.submitted_folder()), "python -m tui.cli.derived"
    (tmp_path / "1.json").write_text(evidence_text(evidence("confirmed", "", kind="simulated")))
    assert with_confirmed(page, tmp_path) == with_confirmed(page, tmp_path / "none")
    (tmp_path / "2.json").write_text(evidence_text(evidence("confirmed", "")))
    row = "| atv21 | ATV21H075M3X | 1.2 | 2026-03-01, RTU 19200 8E1 | dEC |  |"
    assert row in with_confirmed(page, tmp_path)
    assert len(all_evidence(tmp_path)) == 2


def test_every_confidence_has_words_on_the_screens() -> None:
    assert set(get_args(Confidence)) == set(CONFIDENCE_WORDS) == set(SURENESS)
    assert CONFIDENCE_WORDS["site"] == SURENESS["site"] == "proved on this site"


def test_schema_of_evidence_is_up_to_date() -> None:
    committed = library.packaged_folder() / "evidence.schema.json"
    assert committed.read_text("utf-8") == schema_text("evidence")
