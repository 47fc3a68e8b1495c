"""Self-test of a profile: each step tests one claim of the file on the simulated drive."""

from __future__ import annotations

from collections.abc import Iterator

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.values import is_enumeration, raw_range, type_range, word_count

from .command_steps import command_steps
from .drive_steps import drive_steps
from .proof_bench import ProofBench, Unproved
from .proof_step import ProofStep


def prove_profile(profile: Profile) -> Iterator[ProofStep]:
    """Test a checked profile on the drive that is simulated from it, step by step."""
    yield from _reads(profile)
    yield from command_steps(profile)
    yield from _limits(profile)
    yield from drive_steps(profile)


def _each(path: TomlPath, title: str, rows: Iterator[tuple[TomlPath, str]]) -> Iterator[ProofStep]:
    """Yield the faults of many rows, each at its place, or one step that passed."""
    faults = [ProofStep(at, title, text) for at, text in rows]
    yield from faults or [ProofStep(path, title)]


def _reads(profile: Profile) -> Iterator[ProofStep]:
    bench = ProofBench(profile, None)

    def faults() -> Iterator[tuple[TomlPath, str]]:
        for index, parameter in enumerate(profile.parameters):
            if parameter.access != "w":
                try:
                    bench.read(parameter)
                except Unproved as error:
                    yield ("parameters", index), f"{parameter.code} cannot be read: {error}"

    yield from _each(("parameters",), "every parameter is read", faults())


def _limits(profile: Profile) -> Iterator[ProofStep]:
    bench = ProofBench(profile, None)

    def faults() -> Iterator[tuple[TomlPath, str]]:
        for index, parameter in enumerate(profile.parameters):
            if parameter.access in ("rw", "rw-stopped") and not parameter.forbidden:
                for raw in _beyond(profile, parameter):
                    if _takes(bench, parameter, raw):
                        text = f"{parameter.code} accepts {raw}, beyond its limits"
                        yield ("parameters", index), text

    yield from _each(("parameters",), "values beyond limits are refused", faults())


def _beyond(profile: Profile, parameter: Parameter) -> Iterator[int]:
    """Yield raw values that the profile excludes, and that its type can hold."""
    if word_count(parameter) == 2:
        return
    low, high = type_range(parameter)
    least, most = raw_range(parameter)
    names = profile.names(parameter)
    if names and is_enumeration(parameter):
        least, most = min(names), max(names)
    for raw in (least - 1, most + 1):
        if low <= raw <= high and raw not in names:
            yield raw


def _takes(bench: ProofBench, parameter: Parameter, raw: int) -> bool:
    try:
        bench.write(parameter, raw)
    except Unproved:
        return False
    return bench.read(parameter) == raw
