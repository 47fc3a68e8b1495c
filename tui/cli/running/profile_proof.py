"""`profiles --check` and `--prove`: tests of profile files, on simulated drives and on a line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.drive.profile.profile import Profile
from tui.drive.sentences import counted

from ..documents.other_documents import CheckDocument, ProofDocument, ProofStepField
from ..shared.errors import DIFFERENT, REFUSED_HERE, USAGE, Failure
from ..shared.options import Target
from ..shared.output import print_json
from ..shared.say import say

if TYPE_CHECKING:
    from tui.simulator.proving.proof_bench import ProofStep

ONLY_SIMULATED = (
    "The simulated drive does what the file says. Only a real drive shows if that is true."
)


def check_files(files: list[Path], as_json: bool) -> None:
    """Report every fault of every file; status 2 if there is one."""
    from tui.drive.profile import library
    from tui.drive.profile.register_identity import shared_identification

    found = {path: library.all_faults_of(path) for path in dict.fromkeys(files)}
    found |= {path: shared_identification(path) for path, faults in found.items() if not faults}
    hints = {path: [] if faults else library.hints_of(path) for path, faults in found.items()}
    if as_json:
        print_json(
            [
                CheckDocument(file=str(path), faults=some, hints=hints[path])
                for path, some in found.items()
            ]
        )
    else:
        for path, faults in found.items():
            if not faults:
                checked = library.load_file(path)
                count = len(checked.parameters)
                say(f"{path}: {checked.name}, {count} parameters, no fault found.")
                for hint in hints[path]:
                    say(f"hint: {hint}")
    faults = [fault for some in found.values() for fault in some]
    if faults:
        if as_json:
            raise click.exceptions.Exit(USAGE)
        head = counted(len(faults), "1 fault found:", "{count} faults found:")
        raise Failure("\n".join((head, *faults)), USAGE)


def prove_files(files: list[Path], as_json: bool, *, quiet: bool = False) -> None:
    """Test each file, and print each step, unless `quiet`.

    Raises Failure with status 2 if a file has a fault that `--check` reports, with 1 if a step
    failed.
    """
    documents = [_proved(path) for path in dict.fromkeys(files)]
    if as_json:
        print_json(documents)
    for document in documents if not (as_json or quiet) else ():
        for step in document.steps:
            say(_step_line(step))
        if document.passed:
            steps = counted(len(document.steps), "1 step", "{count} steps")
            say(f"{document.file}: {steps} passed on the simulated drive. {ONLY_SIMULATED}")
        for text in document.not_tested:
            say(f"not tested: {text}")
    faults = [fault for document in documents for fault in document.faults]
    failed = [
        _step_line(step) for document in documents for step in document.steps if not step.passed
    ]
    if not faults and not failed:
        return
    status = USAGE if faults else DIFFERENT
    if as_json:
        raise click.exceptions.Exit(status)
    if faults:
        head = counted(len(faults), "1 fault found:", "{count} faults found:")
        raise Failure("\n".join((head, *faults)), status)
    head = counted(len(failed), "1 step failed:", "{count} steps failed:")
    raise Failure("\n".join((head, *failed)), status)


def prove_on_line(
    path: Path | None,
    more: tuple[str, ...],
    target: Target,
    accept_test: Callable[..., None],
    as_json: bool,
    *,
    without_motor: bool,
) -> None:
    """Try a profile that passes on its simulated drive on one without a motor, with a person."""
    from tui.drive.profile import library
    from tui.session.acceptance.profile_test import MAY_TRY, MOTOR_FIRST, PROVED_HZ, profile_test

    from .confirming import keep_command_proofs

    if path is None or more:
        raise click.UsageError("--line is for --prove of one file.")
    prove_files([path], as_json=False, quiet=as_json)
    profile = library.load_file(path)
    used = {item.id: item.path for item in (*library.listings(), *library.public_listings())}
    if profile.id not in used or library.load_file(used[profile.id]).data != profile.data:
        text = f"{path} is not the profile {profile.id} that Drive Panel uses. Put it into"
        raise Failure(f"{text} {library.user_folder()}, then try again.", USAGE)
    if not without_motor:
        raise Failure(MOTOR_FIRST, REFUSED_HERE)
    for line in MAY_TRY:
        say(line.format(hz=PROVED_HZ), err=True)
    accept_test(profile_test(profile, path), target, as_json=as_json, prove=keep_command_proofs)


def _step_line(step: ProofStepField) -> str:
    if step.passed:
        return f"passed  {step.name}"
    return f"FAILED  {step.file}:{step.line}: {step.name}: {step.fault}"


def _proved(path: Path) -> ProofDocument:
    """Return the result of a file; without steps if it has faults."""
    from tui.drive.profile import library
    from tui.simulator.proving.proof_steps import prove_profile

    if faults := library.all_faults_of(path):
        return ProofDocument(file=str(path), passed=False, faults=faults, steps=[], not_tested=[])
    profile = library.load_file(path)
    proved = list(prove_profile(profile))
    steps = [_field(step, path) for step in proved]
    passed = all(step.passed for step in steps)
    return ProofDocument(
        file=str(path), passed=passed, faults=[], steps=steps, not_tested=untested(profile, proved)
    )


def _field(step: ProofStep, path: Path) -> ProofStepField:
    from tui.drive.profile import library
    from tui.drive.profile.shared_rows import read_tables

    if not step.fault:
        return ProofStepField(name=step.title, passed=True, file=None, line=None, fault=None)
    file, line = read_tables(path, library.packaged_folder()).place(step.path)
    return ProofStepField(name=step.title, passed=False, file=file, line=line, fault=step.fault)


def untested(profile: Profile, steps: Sequence[ProofStep]) -> list[str]:
    """Return a sentence for each important subject that no step tested, with what the file
    lacks."""
    data = profile.data
    places = {step.path[0] for step in steps}
    orders = {order.id for chart in data.charts for order in chart.orders}
    titles = [step.title for step in steps]
    tested = {
        "Commands and stops: there are no [[charts]] with orders.": "charts" in places,
        "Reverse: there is no order reverse.": "reverse" in orders or "forward" not in orders,
        "References: there are no [[references]] with a unit, or no order forward.": any(
            title.endswith(" agree") for title in titles
        ),
        "The output frequency: no parameter has the quantity output_frequency.": bool(
            profile.quantity("output_frequency")
        ),
        "Fault numbers: there are no codes in [faults].": bool(data.faults.codes),
        "Communication loss: there is no [communication_fault] with a timeout and a chart.": (
            "communication_fault" in places
        ),
        "Saving: there is no [memory.save], or no setting that waits for it.": any(
            title.startswith("settings are saved") for title in titles
        ),
        "Addresses and word order: there are no [[frames]] of the manual.": "frames" in places,
    }
    return [text for text, is_tested in tested.items() if not is_tested]
