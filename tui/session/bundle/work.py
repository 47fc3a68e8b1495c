"""Creation of a bundle: all its parts in their order, then the zip without names and passwords."""

from __future__ import annotations

import io
import json
import textwrap
import time
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

import tui
from tui.bus.program import Program
from tui.drive.sentences import counted

from .drive_parts import drive_parts, past_parts
from .line_parts import line_parts, record_parts
from .parts import Content, PartProgress, PartResult, collect_parts, in_own_thread
from .redaction import OMITTED_KINDS, Redaction, local_names
from .subject import BundleSubject

README_NAME = "README.txt"
README_WIDTH = 90
PRIVATE_MODE = 0o600
NEVER_IN_BUNDLE = (
    "Never in it: passwords and keys of brokers, other files of this computer, values of other"
    " programs."
)
KEPT_IN_BUNDLE = (
    "Kept: IP addresses, serial numbers of adapters and drives, and the names in the drives."
)


@dataclass(frozen=True, slots=True)
class Bundle:
    """A finished bundle."""

    data: bytes
    """The zip."""
    files: tuple[str, ...]
    missing: dict[str, str]
    """Why a file is missing, by its name."""
    omitted: dict[str, int]
    """Number of omissions by kind."""


def archive(results: Sequence[PartResult], redaction: Redaction, stem: str) -> Bundle:
    """Return the bundle of the collected parts; `stem` is its folder in the zip."""
    dynamic = [result.missing for result in results]
    dynamic += [result.file.note for result in results if result.file is not None]
    for content in (*dynamic, *(item for name, item in _files(results) if _reveals(name))):
        redaction.learn(content)
    fixed = {result.part.name for result in results}
    files = {
        name if name in fixed else redaction.clean(name): _bytes(redaction.clean(content))
        for name, content in _files(results)
    }
    missing = {
        result.part.name: redaction.clean(result.missing)
        for result in results
        if result.file is None
    }
    sizes = {name: len(data) for name, data in files.items()}
    head = list(_head(results, missing, redaction, sizes))
    # only now: notes and reasons are cleaned, too
    omitted = {OMITTED_KINDS[by]: count for by, count in sorted(redaction.counts.items())}
    readme = "\n".join([*head, *_omitted_lines(omitted), ""])
    files = {README_NAME: readme.encode(), **files}
    return Bundle(_zipped(files, stem), tuple(files), missing, omitted)


def _reveals(name: str) -> bool:
    """Return True if the texts of a file may reveal names; those of profiles are public."""
    return not name.startswith("profiles/")


def _files(results: Sequence[PartResult]) -> Iterator[tuple[str, Content]]:
    for result in results:
        if result.file is not None:
            yield result.part.name, result.file.content
            folder = result.part.name.rpartition("/")[0]
            for name, content in result.file.more.items():
                yield f"{folder}/{name}".lstrip("/"), content


def _bytes(content: Content) -> bytes:
    if isinstance(content, bytes):
        return content
    if isinstance(content, str):
        return content.encode("utf-8", "replace")
    text = json.dumps(content, ensure_ascii=False, indent=2, default=str)
    return f"{text}\n".encode("utf-8", "replace")


def _head(
    results: Sequence[PartResult],
    missing: dict[str, str],
    redaction: Redaction,
    sizes: dict[str, int],
) -> Iterator[str]:
    now = datetime.now().astimezone()
    yield f"Bundle of Drive Panel {tui.__version__}, {now:%Y-%m-%d %H:%M:%S %z}"
    yield ""
    yield "Made by `drivepanel bundle`, or by the panel. Nothing was written to any drive."
    yield ""
    yield "Files"
    yield "-----"
    described = set()
    for result in results:
        if result.file is None:
            continue
        described.add(result.part.name)
        yield f"{result.part.name} ({_bytes_text(sizes[result.part.name])})"
        yield from _indented(result.part.about)
        yield from _indented(redaction.clean(result.file.note))
    for name in sizes:
        if name not in described:
            yield f"{name} ({_bytes_text(sizes[name])})"
    yield ""
    yield "Could not get"
    yield "-------------"
    for name, why in missing.items():
        yield f"{name}, because:"
        yield from _indented(why)
    if not missing:
        yield "Nothing: all files are here."
    yield ""


def _bytes_text(size: int) -> str:
    return counted(size, "1 byte", "{count} bytes")


def _indented(text: str) -> Iterator[str]:
    """Yield the lines of a text wrapped at words; commands stay whole."""
    for line in text.splitlines():
        parts = [line] if line.startswith("tshark ") else textwrap.wrap(line, README_WIDTH)
        yield from (f"    {part}" for part in parts)


def _omitted_lines(omitted: dict[str, int]) -> Iterator[str]:
    yield "Omitted"
    yield "-------"
    for kind in OMITTED_KINDS.values():
        count = omitted.get(kind, 0)
        yield counted(count, "{kind}: 1 place", "{kind}: {count} places", kind=kind)
    by = ", ".join(f"{sign} for {kind}" for sign, kind in OMITTED_KINDS.items())
    yield ""
    yield from textwrap.wrap(f"In their places: {by}.", README_WIDTH)
    yield from textwrap.wrap(NEVER_IN_BUNDLE, README_WIDTH)
    yield from textwrap.wrap(KEPT_IN_BUNDLE, README_WIDTH)


def _zipped(files: dict[str, bytes], stem: str) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        for name, data in files.items():
            about = zipfile.ZipInfo(f"{stem}/{name}", time.localtime()[:6])
            about.external_attr = PRIVATE_MODE << 16
            about.compress_type = zipfile.ZIP_DEFLATED
            made.writestr(about, data)
    return out.getvalue()


async def make_bundle(
    subject: BundleSubject, stem: str, progress: PartProgress | None = None
) -> Bundle:
    """Collect the parts of a bundle and pack them; `stem` is its folder in the zip.

    No part ends it: what cannot be collected is in `Bundle.missing`. Raises nothing but a
    cancellation.
    """
    drives = [part for device in subject.devices for part in drive_parts(subject, device)]
    # after the drives, so that frames and counts contain what those parts have requested
    parts = [*drives, *line_parts(subject), *past_parts(subject), *record_parts(subject)]
    results = await collect_parts(parts, progress)
    results = [*results[len(drives) :], *results[: len(drives)]]

    def pack() -> Bundle:
        redaction = Redaction(local_names(program.user for program in _programs(subject)))
        redaction.learn(subject.text)
        return archive(results, redaction, stem)

    return await in_own_thread(pack)


def _programs(subject: BundleSubject) -> tuple[Program, ...]:
    """Return the programs on the line; messages name their users."""
    if subject.opened is None:
        return ()
    facts = subject.opened.line.facts
    return (*facts.programs, *facts.departed)
