"""Parts of a bundle fail alone: by an error, by time, by a disk that hangs."""

from __future__ import annotations

import asyncio
import io
import threading
import zipfile

import pytest

from tui.bus.api import LineState, LineStatus
from tui.bus.fake import FakeLine
from tui.bus.link import SerialLink
from tui.session.bundle.drive_parts import drive_parts
from tui.session.bundle.parts import Missing, Part, PartFile, collect_parts, in_own_thread
from tui.session.bundle.redaction import Names, Redaction
from tui.session.bundle.subject import BundleSubject, DriveDocuments
from tui.session.bundle.work import archive
from tui.session.connect.open_line import OpenLine
from tui.session.drive import DriveSession


async def good() -> PartFile:
    return PartFile("of jdoe", "half of it", more={"b.json": {"by": "jdoe"}})


async def missing() -> PartFile:
    raise Missing("jdoe has it")


async def broken() -> PartFile:
    raise ZeroDivisionError("by zero")


async def endless() -> PartFile:
    await asyncio.sleep(3600)
    raise AssertionError


PARTS = (
    Part("x/a.txt", "A text.", good),
    Part("missing", "", missing),
    Part("broken", "", broken),
    Part("endless", "", endless, limit=0.01),
    Part("z.txt", "The last.", good),
)


async def test_failed_part_does_not_end_others() -> None:
    steps: list[tuple[int, int, str]] = []
    results = await collect_parts(PARTS, lambda *step: steps.append(step))
    assert [result.missing for result in results] == [
        "", "jdoe has it", "by zero", "It took longer than 0.01 s.", "",
    ]  # fmt: skip
    assert [result.file is not None for result in results] == [True, False, False, False, True]
    assert steps[0] == (0, 5, "x/a.txt")
    assert steps[-1] == (5, 5, "")


async def test_cancellation_ends_the_collection() -> None:
    work = asyncio.create_task(collect_parts([Part("endless", "", endless)]))
    await asyncio.sleep(0)
    work.cancel()
    with pytest.raises(asyncio.CancelledError):
        await work


async def test_blocked_thread_does_not_block_the_exit() -> None:
    free = threading.Event()

    async def blocked() -> PartFile:
        await in_own_thread(free.wait)
        raise AssertionError

    (result,) = await collect_parts([Part("disk", "", blocked, limit=0.01)])
    assert result.missing == "It took longer than 0.01 s."
    free.set()
    with pytest.raises(ZeroDivisionError):
        await in_own_thread(lambda: 1 // 0)


async def test_readme_names_files_reasons_and_what_was_omitted() -> None:
    made = archive(await collect_parts(PARTS), Redaction(Names(users=frozenset({"jdoe"}))), "stem")
    with zipfile.ZipFile(io.BytesIO(made.data)) as opened:
        assert opened.testzip() is None
        texts = {name: opened.read(name).decode() for name in opened.namelist()}
        assert all(info.external_attr >> 16 == 0o600 for info in opened.infolist())
    readme = texts["stem/README.txt"]
    assert not any("jdoe" in text for text in texts.values())
    assert texts["stem/x/a.txt"] == "of [user]"
    assert '"by": "[user]"' in texts["stem/x/b.json"]
    assert "A text." in readme
    assert "half of it" in readme
    assert "missing, because:\n    [user] has it\n" in readme
    assert "broken, because:\n    by zero\n" in readme
    assert "user names: 5 places" in readme
    assert made.omitted == {"user names": 5}
    assert set(made.missing) == {"missing", "broken", "endless"}


async def test_nothing_is_sent_to_a_drive_if_its_diagnosis_sends_nothing() -> None:
    line = FakeLine({2: {}}, link=SerialLink("/dev/nosuch"))
    line.state = LineState(LineStatus.LOST, "The adapter is gone.", 0.0)

    async def opened(_: int) -> DriveSession:
        raise AssertionError("the drive is requested")

    subject = BundleSubject(
        text="/dev/nosuch",
        link=line.link,
        opened=OpenLine("/dev/nosuch", line),
        trouble=None,
        devices=(2,),
        open_drive=opened,
        documents=DriveDocuments(lambda *_: {"why": True}, lambda *_: {}, lambda *_: {}),
        expected_profile=lambda _: None,
    )
    why, *others = await collect_parts([*drive_parts(subject, 2)])
    assert why.file is not None
    assert why.file.content == {"why": True}
    assert len(others) == 3
    assert all("Nothing was sent to the drive." in other.missing for other in others)
