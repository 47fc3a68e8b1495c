"""Form of a file of evidence: what one drive showed about the statements of a profile."""

from typing import Annotated, Literal

from .base import Table, about

EvidenceResult = Literal["confirmed", "contradicted", "open"]
EvidenceSubject = Literal["identity", "address", "range", "value", "frame", "command", "reference"]


EvidenceKind = Literal["drive", "simulated", "unknown"]


class EvidenceDrive(Table, frozen=True, kw_only=True):
    """The drive as it identified itself."""

    vendor: str = ""
    reference: str = ""
    firmware: Annotated[str, about("Version that the drive reports; empty if it reports none.")] = (
        ""
    )
    kind: Annotated[
        EvidenceKind,
        about(
            "`drive` if a person said that it is a real one. Only then does the file "
            "prove anything."
        ),
    ]
    link: Annotated[str, about("Kind and settings of the line, without its name: RTU 19200 8E1.")]


class EvidenceFinding(Table, frozen=True, kw_only=True):
    """EvidenceResult for one statement of the profile."""

    subject: Annotated[
        EvidenceSubject,
        about(
            "`address`: the parameter can be read there. `range`: its value is one "
            "that the profile lets it have. `value`: the display shows the same value. "
            "`frame`: the reply has the printed form. `command`: the drive without its "
            "motor did what the command says. `reference`: its feedback agreed with "
            "the reference."
        ),
    ]
    name: Annotated[
        str,
        about(
            "Code of the parameter, the section of the manual with the frame, or chart "
            "and command; empty for the drive."
        ),
    ]
    statement: Annotated[
        str,
        about("The statement as tested, so that a changed profile is not proved by it."),
    ] = ""
    result: EvidenceResult
    seen: Annotated[str, about("Observation on this drive.")] = ""


class ProfileEvidence(Table, frozen=True, kw_only=True):
    """One test of one drive."""

    format: Literal[1] = 1
    profile: Annotated[str, about("Id of the profile.")]
    date: Annotated[str, about("Time of the test, with its zone.")]
    program: Annotated[str, about("Version of Drive Panel.")]
    tested: EvidenceDrive
    findings: list[EvidenceFinding]

    def count(self, result: EvidenceResult) -> int:
        """Return the number of findings with a result."""
        return sum(finding.result == result for finding in self.findings)

    @property
    def is_of_another_family(self) -> bool:
        """True if the drive said that it is of another family: then it proves nothing."""
        wrong = (f for f in self.findings if f.result == "contradicted")
        return any(f.subject == "identity" for f in wrong)
