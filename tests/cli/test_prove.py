"""`drivepanel prove`: its question before a turning motor is not polled, and the port tested."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import msgspec

from tests.session.test_proof_result import AS_SET, FREEWHEEL, NEVER, SLF
from tui.cli.commands.prove import prove_document
from tui.cli.documents.document import DriveFields
from tui.session.proof.result import ProofResult

from .commands import ended, refused, tcp_line

ON_THE_RUN = ("prove", "sim:atv312", "--arm", "--turning")


def test_running_motor_without_a_terminal_requires_yes() -> None:
    output = refused(5, *ON_THE_RUN)
    assert "a hoist falls" in output
    assert "--yes says that this is meant" in output
    error = refused(6, *ON_THE_RUN, "--yes")
    assert "the motor is at standstill" in error
    assert "Sent by this command: CMD = 16#0007" in error, "its stop"


def test_timeout_of_each_port_is_tested() -> None:
    output = refused(1, "prove", "sim:powerdrive", "-p", "powerdrive", "--arm")
    assert "15.07 is Off and 11.63 is Off. The drive does not react to a" in output
    with tcp_line("powerdrive@1", "--set", "11.63=5", "--any-settings") as line:
        reported = ended(1, "prove", line, "-p", "powerdrive", "--arm")
    # the simulated drive is polled through its module, which has another timeout
    assert "DID NOT REACT to 1.5 s without a request. It is set to 0.5 s" in reported.stdout


def figures(result: ProofResult) -> dict[str, Any]:
    fields: DriveFields = {"line": "L", "device": 1, "profile": "atv312", "timeout": None}
    document = prove_document(fields, result, was_reset=False)
    found: dict[str, Any] = msgspec.to_builtins(document)
    head = ("schema", "command", *fields)
    return {name: value for name, value in found.items() if name not in head}


def test_result_is_reported_in_figures() -> None:
    assert figures(replace(AS_SET, changed="ttO is 2 s.")) == {
        "configured_ms": 2000,
        "not_before_ms": 1880,
        "not_after_ms": 2120,
        "measured_ms": 2000,
        "reaction": FREEWHEEL.name,
        "seen": "trips",
        "fault": SLF,
        "turning": False,
        "as_set": True,
        "text": AS_SET.text,
        "changed": "ttO is 2 s.",
        "reset": False,
    }
    nothing = figures(replace(NEVER, reaction=None))
    missing = {"not_after_ms", "measured_ms", "reaction", "seen", "fault", "changed"}
    assert {name for name, value in nothing.items() if value is None} == missing
