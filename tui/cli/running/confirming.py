"""`drivepanel profiles confirm`: what one drive shows about the statements of its profile."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

import tui
from tui.drive.errors import ValueRefused
from tui.drive.profile.schema import (
    EvidenceDrive,
    EvidenceFinding,
    EvidenceKind,
    Parameter,
    ProfileEvidence,
)
from tui.drive.sentences import counted

from ..shared.asking import may_ask, says_yes, typed_answer
from ..shared.drive_commands import watched
from ..shared.errors import DIFFERENT, DONE, Failure
from ..shared.options import Target, on_line
from ..shared.output import print_json
from ..shared.say import say
from ..shared.sets import counter, write_down
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.session.acceptance.result import AcceptanceResult
    from tui.session.conformance import Conformance
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.drive_documents import ConfirmDocument

LISTED = 20
"""Open statements that a person is shown; the file has all."""


def confirm_profile(
    target: Target, codes: Sequence[str], file: Path | None, *, force: bool, as_json: bool
) -> int:
    """Test one drive, write its evidence, and return the exit status.

    Status 1 is a contradicted statement. `codes` are compared with the display; by default the
    measured values and ratings. `file` is by default a new one in the folder of this site, where
    it counts; evidence that proves nothing must be given a name.
    """

    async def work(opened: OpenLine) -> int:
        from tui.session.conformance import Conformance

        # a drive that is not polled while a person types may react to its timeout
        async with watched(opened, target._replace(force_profile=True)) as (_, console):
            session = console.session
            wanted = [session.profile.find(code).code for code in codes]
            kind = await drive_kind(opened)
            test = Conformance(session)
            await test.run(counter())
            for code in (wanted or test.codes_to_ask()) if may_ask() else wanted:
                await _ask_display(test, code)
        evidence = _evidence(session, test.findings, kind)
        path = file or _new_file(evidence)
        if not as_json:
            # before the disk can refuse the file; beside the evidence on standard output
            _say_findings(evidence, err=path == STANDARD)
        await asyncio.to_thread(_write, path, evidence, force=force)
        if as_json:
            print_json(_document(evidence, path))
        else:
            _say_result(evidence, path, err=path == STANDARD)
        return DIFFERENT if evidence.count("contradicted") else DONE

    return on_line(target, work, read_only=True)


async def drive_kind(opened: OpenLine) -> EvidenceKind:
    """Return whether the drive is a real one, as a person says; a simulated one is never asked."""
    if opened.simulation is not None:
        return "simulated"
    if not may_ask():
        return "unknown"
    question = "Is this a real drive, not a simulated one? Only a real one proves anything."
    return "drive" if await says_yes(question) else "simulated"


def _new_file(evidence: ProfileEvidence) -> Path:
    """Return a new file: in the folder of this site only if it may prove something."""
    from tui.drive.profile.library import evidence_folder

    now = datetime.now().strftime("%Y%m%d-%H%M%S")
    folder = evidence_folder() if evidence.tested.kind == "drive" else Path()
    return folder / f"{evidence.profile}-{now}.json"


def keep_command_proofs(
    session: DriveSession, result: AcceptanceResult, kind: EvidenceKind
) -> None:
    """Write what a test of commands without a motor has shown, and report it. Raises Failure."""
    from tui.session.acceptance.profile_test import command_findings

    evidence = _evidence(session, command_findings(session, result), kind)
    path = _new_file(evidence)
    _say_findings(evidence, err=True)
    _write(path, evidence, force=False)
    _say_result(evidence, path, err=True)


async def _ask_display(test: Conformance, code: str) -> None:
    """Ask until the answer is a value, or is left open."""

    async def ask(parameter: Parameter) -> str:
        if not may_ask():
            return ""
        return await typed_answer(
            f"{parameter.code}, {parameter.name}: what does the drive's display show?"
            " (Enter: leave open)"
        )

    while True:
        try:
            finding = await test.compare_display(code, ask)
        except ValueRefused as refused:
            say(f"drivepanel: {refused}", err=True)
        else:
            if finding.result != "open":
                say(f"{code}: {finding.result}. {finding.seen}", err=True)
            return


def _evidence(
    session: DriveSession, findings: list[EvidenceFinding], kind: EvidenceKind
) -> ProfileEvidence:
    from tui.session.journal import now_text

    identity = session.known_identity
    tested = EvidenceDrive(
        vendor=identity.vendor,
        reference=identity.reference,
        firmware=identity.version_text if identity.version else "",
        kind=kind,
        link=_link_text(session),
    )
    return ProfileEvidence(
        profile=session.profile.id,
        date=now_text(),
        program=tui.__version__,
        tested=tested,
        findings=findings,
    )


def _link_text(session: DriveSession) -> str:
    """Return the kind of the line and its settings, without the name of a port or host."""
    from tui.bus.link import RtuTcpLink, SerialLink

    link = session.line.link
    if isinstance(link, SerialLink):
        return f"RTU {link.baud} {link.format}"
    return "RTU over TCP" if isinstance(link, RtuTcpLink) else "Modbus TCP"


def _write(path: Path, evidence: ProfileEvidence, *, force: bool) -> None:
    """Write the file completely or not at all. Raises Failure."""
    from tui.drive.profile.evidence import evidence_text

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Failure(f"{path} cannot be written: {error.strerror or error}.", 2) from error
    write_down(path, evidence_text(evidence), force=force)


def _document(evidence: ProfileEvidence, path: Path) -> ConfirmDocument:
    from ..documents.drive_documents import ConfirmDocument, FindingField

    return ConfirmDocument(
        profile=evidence.profile,
        file=str(path),
        tested_on=evidence.tested.kind,
        reference=evidence.tested.reference,
        firmware=evidence.tested.firmware,
        confirmed=evidence.count("confirmed"),
        contradicted=evidence.count("contradicted"),
        open=evidence.count("open"),
        findings=[FindingField(**msgspec.structs.asdict(f)) for f in evidence.findings],
    )


def _say_findings(evidence: ProfileEvidence, *, err: bool) -> None:
    """Show the findings, without the addresses that only answered."""
    for result in ("contradicted", "confirmed", "open"):
        found = [f for f in evidence.findings if f.result == result]
        if result == "confirmed":
            found = [f for f in found if f.subject != "address"]
        for finding in found[:LISTED]:
            name = finding.name
            if finding.subject == "frame":
                name = f"{name}, {finding.statement.partition(' ')[0]}"
            subject = f"{finding.subject} {name}".rstrip()
            say(f"{result:<12}  {subject}: {finding.seen}", indent=14, err=err)
        if len(found) > LISTED:
            say(f"{result:<12}  and {len(found) - LISTED} more in the file", err=err)


def _say_result(evidence: ProfileEvidence, path: Path, *, err: bool) -> None:
    say(
        f"{evidence.count('confirmed')} confirmed, {evidence.count('contradicted')} contradicted,"
        f" {evidence.count('open')} open. Evidence: {path}",
        err=err,
    )
    shown = [f.subject for f in evidence.findings if f.result == "confirmed"]
    proved, followed = shown.count("value"), shown.count("command") + shown.count("reference")
    if evidence.is_of_another_family:
        say("It proves nothing: the drive is of another family.", err=err)
    elif evidence.tested.kind != "drive":
        say("It proves nothing: no person has said that this is a real drive.", err=err)
    elif proved:
        texts = ("1 value is proved on this site.", "{count} values are proved on this site.")
        say(counted(proved, *texts), err=err)
    elif followed:
        say("What was confirmed is proved on this site.", err=err)
