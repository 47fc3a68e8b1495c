"""Writing one parameter to an unpredictable drive: its value read back is what is known."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, cast
from unittest.mock import Mock

import msgspec
import pytest

from tui.bus.api import Priority, Reply
from tui.bus.errors import DeviceException, LineError, NoAnswer, RequestRefused, Superseded
from tui.bus.fake_device import FakeDevice
from tui.bus.requests import WriteOne
from tui.session.arming import NotArmed
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.journal import Entry, Journal
from tui.session.journal_reading import completed, read_journal
from tui.session.read.reader import Reader
from tui.session.reading import Reading
from tui.session.settings.write import (
    CUT_SHORT,
    NotTaken,
    Writer,
    device_refusal,
    parameter_entry,
)
from tui.session.work import Permit, Stopped

from .fakes import OneDrive, parameter, profile_of

INR = {"parameter": "INR", "scales": {"0": "0.01", "1": "0.1", "2": "1"}}
PROFILE = profile_of(
    parameter("ACC", 10, unit="s", scale_by=INR),
    parameter("INR", 11),
    parameter("CMD", 12, access="w"),
    functions=[{"code": 3, "name": "Read", "max_read": 29}, {"code": 6, "name": "Write"}],
)


class WilfulDrive(FakeDevice):
    """A drive that keeps or changes written values, as the test sets."""

    keeps: Callable[[int, int], int] = staticmethod(lambda _address, word: word)

    def take(self, address: int, values: Sequence[int]) -> None:
        super().take(address, [self.keeps(address, value) for value in values])


class WilfulLine(OneDrive):
    """A line with such a drive, and something that happens while a write waits."""

    def __init__(self) -> None:
        super().__init__({10: 30, 11: 1, 12: 0})
        self.drive = self.devices[1] = WilfulDrive(1, self.registers)
        self.before: Callable[[], None] = lambda: None

    @property
    def written(self) -> list[tuple[int, int]]:
        """Address and word of all writes that were sent."""
        return [
            (request.address, request.value)
            for request in self.requests
            if isinstance(request, WriteOne)
        ]

    async def write(self, *what: Any, **how: Any) -> float:
        self.before()
        return await super().write(*what, **how)


@pytest.fixture
def line() -> WilfulLine:
    """A drive that holds ACC = 3.0 s."""
    return WilfulLine()


@pytest.fixture
def session(line: WilfulLine) -> DriveSession:
    """An armed session with it."""
    made = DriveSession(line, 1, PROFILE)
    made.arming.arm(seconds=math.inf)
    return made


def writer(session: DriveSession, journal: Journal, permit: Permit | None = None) -> Writer:
    return Writer(session, journal, permit or session.work.permit())


async def test_verified_value_is_known_and_recorded(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    await Reader(session).read(["ACC"])
    await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert line.written == [(10, 50)]
    assert session.image.raws["ACC"] == 50
    (entry,) = journal.recent
    assert (entry.old, entry.new, entry.answer, entry.read_back) == ("3.0 s", "5.0 s", "ok", 50)


@pytest.mark.parametrize("kept", [30, 49, 51, 0xFFFF])
async def test_different_value_read_back_is_reported_and_known(
    line: WilfulLine, session: DriveSession, journal: Journal, kept: int
) -> None:
    line.drive.keeps = lambda _address, _word: kept
    with pytest.raises(NotTaken, match=r"ACC was written as 5\.0 s, but the drive holds"):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert session.image.raws["ACC"] == kept
    (entry,) = journal.recent
    assert (entry.answer, entry.read_back) == ("holds another value", kept)


async def test_only_checked_bits_must_match(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    line.drive.keeps = lambda _address, word: word | 0x8000
    await writer(session, journal).write_parameter(PROFILE["INR"], 1, why="bits", check=0x00FF)
    with pytest.raises(NotTaken):
        await writer(session, journal).write_parameter(PROFILE["INR"], 1, why="bits", check=0x80FF)


async def test_refused_write_makes_the_word_unknown(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    """Only confirmed reads are known: neither the new value nor the old one is."""
    await Reader(session).read(["ACC"])
    line.fail_write(1, 10, 4)
    with pytest.raises(DeviceException):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert "ACC" not in session.image.raws
    await Reader(session).read(["ACC"])
    assert session.image.raws["ACC"] == 30


async def test_unanswered_write_makes_the_word_unknown(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    await Reader(session).read(["ACC"])
    line.fail_write(1, 10, NoAnswer(1, 6, 10), taken=True)
    with pytest.raises(NoAnswer):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert "ACC" not in session.image.raws
    (entry,) = journal.recent
    assert "did not answer" in entry.answer
    assert entry.read_back is None


@pytest.mark.parametrize(
    "answer", [RequestRefused("The line is read-only: nothing is written."), Superseded(1, 10)]
)
async def test_unsent_write_keeps_the_known_value(
    line: WilfulLine, session: DriveSession, journal: Journal, answer: LineError
) -> None:
    await Reader(session).read(["ACC"])
    line.fail_write(1, 10, answer)
    with pytest.raises(type(answer)):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert session.image.raws["ACC"] == 30
    assert line.written == []


KEPT_IN_RAM = profile_of(
    parameter("ACC", 10, unit="s", scale="0.1", storage="ram-until-saved"),
    functions=[{"code": 3, "name": "Read", "max_read": 29}, {"code": 6, "name": "Write"}],
)


@pytest.mark.parametrize(
    ("error", "unsaved"),
    [
        (None, {"ACC"}),
        (NoAnswer(1, 6, 10), {"ACC"}),
        (DeviceException(1, 6, 10, 4, "failure"), set()),
        (RequestRefused("The line is read-only: nothing is written."), set()),
    ],
)
async def test_setting_counts_as_unsaved_if_its_frame_was_sent_and_not_refused(
    line: WilfulLine, journal: Journal, error: LineError | None, unsaved: set[str]
) -> None:
    session = DriveSession(line, 1, KEPT_IN_RAM)
    session.arming.arm(seconds=math.inf)
    await Reader(session).read(["ACC"])
    if error is not None:
        line.fail_write(1, 10, error)
    with suppress(LineError):
        await writer(session, journal).write_parameter(KEPT_IN_RAM["ACC"], 50, why="setting")
    assert session.unsaved_settings.codes == unsaved


async def test_reply_from_before_the_write_is_not_used(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    held = (await Reader(session).read(["ACC"]))["ACC"]
    line.fail_write(1, 10, NoAnswer(1, 6, 10), taken=True)
    with pytest.raises(NoAnswer):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert held.raw is not None
    session.image.confirm("ACC", held.raw, held.time)
    assert "ACC" not in session.image.raws


async def test_unreadable_value_is_unknown(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    await writer(session, journal).write_parameter(PROFILE["CMD"], 7, why="command")
    assert "CMD" not in session.image.raws
    assert line.requested == []


async def test_journal_has_units_although_the_scale_was_not_read(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert journal.recent[0].new == "5.0 s"


async def test_nothing_is_written_unarmed(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    permit = session.work.permit()
    session.arming.disarm()
    with pytest.raises(NotArmed):
        await writer(session, journal, permit).write_parameter(PROFILE["ACC"], 50, why="setting")
    with pytest.raises(NotArmed):
        session.work.permit()
    assert line.written == []


async def test_nothing_is_written_after_a_stop(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    permit = session.work.permit()
    session.work.stop("the stop key")
    session.arming.arm(seconds=math.inf)
    with pytest.raises(Stopped, match="the stop key"):
        await writer(session, journal, permit).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert line.written == []


async def test_stop_cancels_a_frame_waiting_for_the_line(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    permit = session.work.permit()
    line.before = lambda: session.work.stop("the stop key")
    with pytest.raises(RequestRefused, match="stop came after"):
        await writer(session, journal, permit).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert line.written == []


async def test_slow_drive_is_read_after_its_reply(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    """The read-back is requested after the reply, never at the same time."""
    order: list[str] = []
    read = line.read

    async def slow(
        *args: int,
        priority: Priority = Priority.POLL,
        function: int = 3,
        max_age: float = 0.0,
    ) -> object:
        order.append("read")
        await asyncio.sleep(0)
        return await read(*args, priority=priority, function=function)

    line.read = slow  # type: ignore[method-assign, assignment]
    line.before = lambda: order.append("write")
    await Reader(session).read(["INR"])
    await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert order == ["read", "write", "read"]


def abilities_in(journal: Journal) -> list[Entry]:
    """Entries of the journal files, completions separate from the entries they complete."""
    assert journal.flush(60)
    return [entry for entry in read_journal(journal.files) if isinstance(entry, Entry)]


@pytest.mark.parametrize("taken", [True, False])
async def test_lost_reply_is_completed_by_a_later_read(
    line: WilfulLine, session: DriveSession, journal: Journal, taken: bool
) -> None:
    await Reader(session).read(["ACC"])
    line.fail_write(1, 10, NoAnswer(1, 6, 10), taken=taken)
    with pytest.raises(NoAnswer):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    # any reader, for any reason
    await Reader(session).read(["ACC"])
    await Reader(session).read(["ACC"])
    lost, later = abilities_in(journal)
    assert (lost.kind, lost.read_back) == ("write", None)
    assert (later.kind, later.of, later.read_back) == ("read-back", lost.time, 50 if taken else 30)
    (entry,) = completed([lost, later])
    came = "Accepted: it holds 5.0 s" if taken else "Not accepted: it holds 3.0 s"
    assert entry.answer == f"{lost.answer} {came}, read back later."
    assert entry.read_back == later.read_back


async def test_write_cut_by_a_stop_is_not_recorded_as_done(
    line: WilfulLine,
    session: DriveSession,
    journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun = asyncio.Event()

    async def unanswered(*_: object, **__: object) -> None:
        begun.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(line, "write", unanswered)
    work = writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    task = asyncio.create_task(work)
    await begun.wait()
    task.cancel()
    await asyncio.wait([task])
    assert task.cancelled()
    await Reader(session).read(["ACC"])
    cut, later = abilities_in(journal)
    found = "Not accepted: it holds 3.0 s, read back later."
    assert (cut.answer, later.answer) == (CUT_SHORT, found)


async def test_word_the_drive_may_change_is_reported_but_not_judged(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    line.fail_write(1, 11, NoAnswer(1, 6, 11), taken=True)
    with pytest.raises(NoAnswer):
        await writer(session, journal).write_parameter(
            PROFILE["INR"], 2, why="command", read_back=False
        )
    line.registers[11] = 1
    await Reader(session).read(["INR"])
    assert abilities_in(journal)[-1].answer == "It holds 1, read back later."


async def test_lost_reply_is_not_completed_by_a_later_write(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    line.fail_write(1, 10, NoAnswer(1, 6, 10), times=1)
    with pytest.raises(NoAnswer):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    await writer(session, journal).write_parameter(PROFILE["ACC"], 40, why="setting")
    assert [entry.kind for entry in abilities_in(journal)] == ["write", "write"]


async def test_refused_write_is_journaled_with_its_reply(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    line.fail_write(1, 10, 4)
    with pytest.raises(DeviceException):
        await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    await Reader(session).read(["ACC"])
    assert [entry.kind for entry in abilities_in(journal)] == ["write"]


# -- how a frame is handed to the line -------------------------------------------------------------


class Handed(WilfulLine):
    """A line that notes how each request is handed to it."""

    def __init__(self) -> None:
        super().__init__()
        self.how: list[tuple[str, int, dict[str, Any]]] = []

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        self.how.append(("read", address, {"count": count, **how}))
        return await super().read(device, address, count, **how)

    async def write(self, device: int, address: int, values: Any, **how: Any) -> float:
        self.how.append(("write", address, how))
        return await super().write(device, address, values, **how)


@pytest.mark.parametrize(("replaceable", "within"), [(False, None), (True, 0.25)])
async def test_write_of_a_task_is_forbidden_once_its_permit_ends(
    replaceable: bool, within: float | None, journal: Journal
) -> None:
    line = Handed()
    session = DriveSession(line, 1, PROFILE)
    session.arming.arm(seconds=math.inf)
    permit = session.work.permit()
    await Reader(session).read(["INR"])
    line.how.clear()
    writing = Writer(session, journal, permit)
    await writing.write_parameter(
        PROFILE["ACC"], 50, why="a test", replaceable=replaceable, within=within
    )
    priority = Priority.OPERATOR_WRITE
    assert line.how == [
        ("write", 10, {
            "priority": priority, "replaceable": replaceable, "forbidden": permit.refusal,
            "within": within,
        }),
        ("read", 10, {"count": 1, "priority": priority, "function": 3}),
    ]  # fmt: skip


async def test_write_of_a_stop_has_no_permit_and_reads_nothing(journal: Journal) -> None:
    line = Handed()
    session = DriveSession(line, 1, PROFILE)
    await Writer(session, journal, None).write_parameter(
        PROFILE["CMD"], 7, why="a stop", priority=Priority.STOP, read_back=False
    )
    how = {"priority": Priority.STOP, "replaceable": False, "forbidden": None, "within": None}
    assert line.how == [("write", 12, how)]
    assert not session.arming.armed
    (entry,) = journal.recent
    assert (entry.code, entry.new_raw, entry.answer, entry.read_back) == ("CMD", 7, "ok", None)
    assert (entry.why, entry.address, entry.device, entry.profile) == ("a stop", 12, 1, "small")


async def test_write_without_a_read_back_is_not_compared(
    line: WilfulLine, session: DriveSession, journal: Journal
) -> None:
    line.drive.keeps = lambda _address, _word: 7
    await writer(session, journal).write_parameter(PROFILE["INR"], 1, why="a test", read_back=False)
    assert line.requested == []
    assert "INR" not in session.image.raws
    (entry,) = journal.recent
    assert (entry.answer, entry.read_back) == ("ok", None)


async def test_journal_knows_what_was_sent_and_what_the_drive_refused(
    line: WilfulLine, session: DriveSession, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries: list[dict[str, Any]] = []
    made = parameter_entry

    def noted(*of: Any, **how: Any) -> Entry:
        entries.append(how)
        return made(*of, **how)

    monkeypatch.setattr("tui.session.settings.write.parameter_entry", noted)
    for error in (DeviceException(1, 6, 10, code=2), RequestRefused("a stop came before")):
        line.fail_write(1, 10, error, times=1)
        with pytest.raises(type(error)):
            await writer(session, journal).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert [entry["refused"] for entry in entries] == [True, False]
    assert len(journal.recent) == 2
    assert [entry.answer for entry in journal.sent] == [journal.recent[0].answer]


async def test_write_of_a_saved_setting_is_noted_with_the_value_before_it(
    line: WilfulLine, session: DriveSession, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    noted: list[tuple[object, ...]] = []
    monkeypatch.setattr(Writer, "_note_unsaved", lambda _, *of: noted.append(of))
    await Reader(session).read(["ACC"])
    word = msgspec.structs.replace(PROFILE["ACC"], storage="ram-until-saved")
    await writer(session, journal).write_parameter(word, 50, why="setting")
    assert noted == [(word, 30, 50)]


@pytest.mark.internal_errors
async def test_error_of_the_journal_fails_a_setting_and_no_stop(
    session: DriveSession, caplog: pytest.LogCaptureFixture
) -> None:
    broken = cast(Any, Mock(add=Mock(side_effect=ValueError("on purpose"))))
    with pytest.raises(ValueError, match="on purpose"):
        await writer(session, broken).write_parameter(PROFILE["ACC"], 50, why="setting")
    assert not caplog.messages
    await Writer(session, broken, None).write_parameter(
        PROFILE["CMD"], 7, why="a stop", priority=Priority.STOP, read_back=False
    )
    assert caplog.messages == ["a stop of device 1 is not in the journal"]


async def test_field_keeps_the_other_bits_of_its_word(journal: Journal) -> None:
    functions = [{"code": 3, "name": "Read", "max_read": 29}, {"code": 6, "name": "Write"}]
    fields = (parameter("LOW", 10, mask=0x000F), parameter("HIGH", 10, mask=0x00F0))
    profile = profile_of(*fields, functions=functions)
    line = Handed()
    line.registers[10] = 0xAB53
    session = DriveSession(line, 1, profile)
    session.arming.arm(seconds=math.inf)
    await writer(session, journal).write_parameter(profile["HIGH"], 0x90, why="a test")
    assert line.written == [(10, 0xAB93)]
    assert session.image.raws["HIGH"] == 0x90
    assert [what[:2] for what in line.how] == [("read", 10), ("write", 10), ("read", 10)]
    assert {what[2]["priority"] for what in line.how} == {Priority.OPERATOR_WRITE}


@pytest.mark.parametrize(
    ("check", "back", "text"),
    [
        (0xFFFF, 50, "Accepted: it holds 5.0 s, read back later."),
        (0xFFFF, 51, "Not accepted: it holds 5.1 s, read back later."),
        (0x00FE, 51, "Accepted: it holds 5.1 s, read back later."),
        (0, 99, "It holds 9.9 s, read back later."),
    ],
)
async def test_later_read_completes_the_entry_by_the_bits_that_were_to_be_written(
    check: int, back: int, text: str, session: DriveSession, journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    added: list[Entry] = []
    monkeypatch.setattr(journal, "add", added.append)
    await Reader(session).read(["INR"])
    acc = PROFILE["ACC"]
    entry = parameter_entry(session, acc, old=30, new=50, answer="no answer", why="a test")
    writer(session, journal).complete_later(entry, acc, check)
    session.image.confirm("ACC", back, 5.0)
    session.image.confirm("ACC", 77, 6.0)
    (found,) = added
    assert (found.kind, found.of, found.answer, found.read_back) == (
        "read-back", entry.time, text, back,
    )  # fmt: skip
    assert (found.code, found.why) == ("ACC", "a test")


@pytest.mark.parametrize(("refused", "use"), [(False, "write"), (True, "")])
async def test_entry_of_a_stored_write_names_its_drive_and_its_values(
    refused: bool, use: str, session: DriveSession
) -> None:
    """Without its scale, the value is recorded in the scale of a drive that lacks the word."""
    session.identity = DriveIdentity(1, "Nobody", "Drive 7", "", "", None, ())
    older = {**INR, "absent": "0.1"}
    profile = profile_of(parameter("ACC", 10, unit="s", scale_by=older), parameter("INR", 11))
    session.profile = profile
    session.image.take({"INR": Reading.bad(profile["INR"], 5.0, "none", absent=True)})
    word = msgspec.structs.replace(profile["ACC"], storage="eeprom")
    entry = parameter_entry(
        session, word, old=30, new=50, answer="ok", why="a test", read_back=50, refused=refused
    )
    assert (entry.eeprom, entry.drive) == (use, "Nobody Drive 7" if use else "")
    assert (entry.old_raw, entry.old, entry.new_raw, entry.new) == (30, "3.0 s", 50, "5.0 s")
    assert (entry.answer, entry.read_back, entry.kind) == ("ok", 50, "write")
    plain = parameter_entry(session, word, old=30, new=50, answer="ok", why="a test")
    assert (plain.eeprom, plain.read_back) == ("write", None), "not refused"


async def test_write_reports_if_the_value_was_read_back(
    session: DriveSession, journal: Journal
) -> None:
    at_work = writer(session, journal)
    assert await at_work.write_parameter(PROFILE["ACC"], 50, why="setting")
    assert not await at_work.write_parameter(PROFILE["ACC"], 50, why="setting", read_back=False)
    assert not await at_work.write_parameter(PROFILE["CMD"], 7, why="command")


EXCEPTIONS = [
    {
        "code": 4,
        "name": "Failure",
        "meaning": "It is out of range",
        "remedy": "Type another",
    },
    {"code": 5, "name": "Acknowledge", "meaning": ""},
]


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (4, "The drive refused P1 with exception 4, Failure. It is out of range. The drive is"
         " running. Type another."),
        (5, "The drive refused P1 with exception 5, Acknowledge. The drive is running."),
        (9, "The drive refused P1 with exception 9, which no document of this family explains. The"
         " drive is running."),
    ],
)  # fmt: skip
def test_refusal_of_a_write_has_the_meaning_of_its_family(code: int, text: str) -> None:
    profile = profile_of(parameter("P1", 1), exceptions=EXCEPTIONS)
    refusal = DeviceException(1, 6, 1, code)
    assert device_refusal(profile, profile["P1"], refusal, "running") == text
