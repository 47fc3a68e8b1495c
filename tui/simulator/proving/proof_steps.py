"""Self-test of a profile: each step tests one claim of the file on the simulated drive."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from tui.drive.profile.profile import Profile
from tui.drive.profile.profile_frame import READING, frame_contents
from tui.drive.profile.schema import Parameter, ProfileFrame
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.shown import depends_on, shown_text
from tui.drive.values import (
    from_words,
    is_enumeration,
    raw_range,
    type_range,
    word_count,
)

from .command_steps import command_steps
from .drive_steps import drive_steps
from .proof_bench import ProofBench, Unproved
from .proof_step import ProofStep, proof_step


def prove_profile(profile: Profile) -> Iterator[ProofStep]:
    """Test a checked profile on the drive that is simulated from it, step by step."""
    yield from _reads(profile)
    yield from _frames(profile)
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


# Example frames


def _frames(profile: Profile) -> Iterator[ProofStep]:
    for index, frame in enumerate(profile.data.frames):
        title = f"frame {frame.sent[:17]} means {', '.join(frame.means)}"
        yield proof_step(("frames", index), title, partial(_frame, profile, frame))


def _frame(profile: Profile, frame: ProfileFrame) -> None:
    """Replay a frame on a drive with the values that it contains, and compare its meaning."""
    contents = frame_contents(frame)
    bench = ProofBench(profile, None)
    raws = {}
    for parameter in profile.parameters:
        at = parameter.address - contents.address
        same = parameter.function == contents.function or contents.function not in READING
        if same and 0 <= at <= len(contents.words) - word_count(parameter):
            raws[parameter.code] = from_words(parameter, contents.words[at:])
    if contents.function in READING:
        for code, raw in raws.items():
            bench.drive.set(code, raw)
    if bench.ask(contents.request) != contents.reply:
        raise Unproved("the drive gives another reply")
    for code, raw in raws.items():
        if contents.function not in READING and bench.drive.raw(code) != raw:
            raise Unproved(f"{code} is {bench.drive.raw(code)} after it, not {raw}")
    shown = {text for code, raw in raws.items() for text in _texts(bench, profile[code], raw)}
    if wrong := [text for text in frame.means if text not in shown]:
        raise Unproved(f"it does not mean {wrong[0]}, but {', '.join(sorted(shown)) or 'nothing'}")


def _texts(bench: ProofBench, parameter: Parameter, raw: int) -> tuple[str, str]:
    """Return a value as it is shown, and as a word."""
    raws = bench.raws(depends_on(parameter))
    text = shown_text(bench.profile, parameter, raw, raws)
    return f"{parameter.code} = {text}", f"{parameter.code} = 16#{raw & 0xFFFF:04X}"
