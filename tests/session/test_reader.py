"""The reader of one drive: certain values only, and a refused word hurts no other."""

from __future__ import annotations

import math
from decimal import Decimal
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import Priority, Reply
from tui.bus.errors import NoAnswer
from tui.bus.poll_plan import PlannedRead
from tui.drive.read_plan import Place, ReadPlan, ReadRequest, SlotCheck
from tui.safety import SOURCE_AGE
from tui.session.drive import DriveSession
from tui.session.read.kept_plans import PLANS_KEPT
from tui.session.read.reader import ASK_AGAIN, Reader
from tui.session.reading import Origin, Reading
from tui.session.shown import Quality, Rating

from .fake_clock import FakeClock
from .fakes import BlockDrive, OneDrive, parameter, profile_of

INR = {"parameter": "INR", "scales": {"0": "0.01", "1": "0.1", "2": "1"}}


async def test_neighbors_are_read_in_one_request_with_their_units() -> None:
    profile = profile_of(
        parameter("LCR", 3204, unit="A", scale="0.1"),
        parameter("OTR", 3205, unit="%", scale="0.1", type="int16"),
    )
    line = OneDrive({3204: 53, 3205: 0x10000 - 725})
    readings = await Reader(DriveSession(line, 1, profile)).read(["OTR", "LCR"])
    assert line.requested == [(3204, 2)]
    assert list(readings) == ["OTR", "LCR"]
    assert [r.value.display for r in readings.values() if r.value] == ["-72.5 %", "5.3 A"]
    assert all(r.quality is Quality.GOOD for r in readings.values())


async def test_poll_takes_slow_values_that_lie_between_the_others() -> None:
    """A value that was read or written since the shared reply is not one of them."""
    profile = profile_of(*(parameter(f"P{a}", a) for a in (10, 11, 12, 30)))
    line = OneDrive({10: 1, 11: 2, 12: 3, 30: 4})
    reader = Reader(DriveSession(line, 1, profile), also=frozenset({"P11", "P30"}))
    found = await reader.read(["P10", "P12"], priority=Priority.POLL)
    assert line.requested == [(10, 3)]
    assert {code: item.raw for code, item in found.items()} == {"P10": 1, "P12": 3, "P11": 2}
    later = reader.session.clock.monotonic() + 10.0
    reader.session.image.confirm("P11", 9, later)
    found = await reader.read(["P10", "P12"], priority=Priority.POLL)
    assert set(found) == {"P10", "P12"}
    assert set(await reader.read(["P10", "P12"])) == {"P10", "P12"}


async def test_known_values_have_the_scale_of_their_time() -> None:
    profile = profile_of(
        parameter("ACC", 9001, unit="s", scale="0.1", scale_by=INR), parameter("INR", 9020)
    )
    line = OneDrive({9020: 0, 9001: 1234})
    reader = Reader(DriveSession(line, 1, profile))
    await reader.read(["ACC"])
    assert reader.known(["ACC", "INR"])["ACC"].text == "12.34"
    reader.forget()
    assert reader.known(["ACC"])["ACC"].text == "12.34"
    line.registers[9020] = 1
    await reader.read(["INR"])
    assert reader.known(["ACC"])["ACC"].text == "123.4"


async def test_refused_word_does_not_affect_its_neighbors() -> None:
    profile = profile_of(*(parameter(f"P{a}", a) for a in (10, 11, 12)))
    line = OneDrive({10: 1, 12: 3})
    reader = Reader(DriveSession(line, 1, profile))
    readings = await reader.read(["P10", "P11", "P12"])
    assert {c: r.raw for c, r in readings.items()} == {"P10": 1, "P11": None, "P12": 3}
    assert readings["P11"].quality is Quality.BAD
    assert readings["P11"].text == "-----"
    assert "refused" in readings["P11"].error


async def test_refused_word_is_not_polled_again() -> None:
    profile = profile_of(*(parameter(f"P{a}", a) for a in (10, 11, 12)))
    line = OneDrive({10: 1, 12: 3})
    reader = Reader(DriveSession(line, 1, profile))
    await reader.read(["P10", "P11", "P12"], priority=Priority.POLL)
    line.requests.clear()
    readings = await reader.read(["P10", "P11", "P12"], priority=Priority.POLL)
    assert line.requested == [(10, 1), (12, 1)]
    assert readings["P11"].quality is Quality.BAD
    line.requests.clear()
    await reader.read(["P11"])
    assert line.requested == [(11, 1)]


async def test_word_that_may_mean_no_value_is_read_alone() -> None:
    """16#8000 in a block may be a value or mean none: only a single read shows it."""
    profile = profile_of(
        *(parameter(f"P{a}", a) for a in (8400, 8401, 8402)),
        reading={"unknown_word": 0x8000, "unknown_exception": 2},
    )
    line = OneDrive({})
    line.devices[1] = BlockDrive(1, {8401: 3, 8402: 0x8000})
    readings = await Reader(DriveSession(line, 1, profile)).read(["P8400", "P8401", "P8402"])
    assert {c: r.raw for c, r in readings.items()} == {
        "P8400": None,
        "P8401": 3,
        "P8402": 0x8000,
    }


async def test_ramp_is_read_with_its_increment() -> None:
    profile = profile_of(
        parameter("ACC", 9001, unit="s", scale="0.1", scale_by=INR),
        parameter("INR", 9020, values={"0": "0.01 s", "1": "0.1 s", "2": "1 s"}),
    )
    line = OneDrive({9001: 30, 9020: 0})
    reader = Reader(DriveSession(line, 1, profile))
    assert (await reader.read(["ACC"]))["ACC"].text == "0.30"
    line.registers[9020] = 2
    assert (await reader.read(["ACC"]))["ACC"].text == "30"


async def test_poll_reads_an_increment_again_only_after_its_time() -> None:
    profile = profile_of(
        parameter("ACC", 9001, unit="s", scale="0.1", scale_by=INR), parameter("INR", 9020)
    )
    line, clock = OneDrive({9001: 30, 9020: 0}), FakeClock()
    reader = Reader(DriveSession(line, 1, profile, clock=clock))

    async def reads(priority: Priority) -> int:
        line.requests.clear()
        await reader.read(["ACC"], priority=priority)
        return len([address for address, _ in line.requested if address == 9020])

    assert await reads(Priority.POLL) == 1
    assert [await reads(each) for each in (Priority.POLL, Priority.OPERATOR_READ)] == [0, 1]
    clock.advance(SOURCE_AGE + 1.0)
    assert await reads(Priority.POLL) == 1


async def test_ramp_without_its_increment_is_shown_raw() -> None:
    profile = profile_of(
        parameter("ACC", 9001, unit="s", scale="0.1", scale_by=INR), parameter("INR", 9020)
    )
    line = OneDrive({9001: 30})
    reading = (await Reader(DriveSession(line, 1, profile)).read(["ACC"]))["ACC"]
    assert (reading.text, reading.unit) == ("30", "raw")


async def test_drive_without_the_increment_has_the_older_scale() -> None:
    older = {**INR, "absent": "0.1"}
    profile = profile_of(
        parameter("ACC", 9001, unit="s", scale="0.1", scale_by=older), parameter("INR", 9020)
    )
    line = OneDrive({9001: 30})
    reading = (await Reader(DriveSession(line, 1, profile)).read(["ACC"]))["ACC"]
    assert (reading.text, reading.unit) == ("3.0", "s")


async def test_percentage_is_in_amperes_once_the_rating_is_known() -> None:
    profile = profile_of(
        parameter("FE03", 65027, unit="%", scale="0.01"),
        parameter("OWN", 10, unit="%", scale="1", rating="NCR"),
        parameter("NCR", 11, unit="A", scale="0.1"),
    )
    reader = Reader(DriveSession(OneDrive({65027: 5000, 10: 50, 11: 84}), 1, profile))
    readings = await reader.read(["FE03", "OWN"])
    assert readings["FE03"].physical is None
    assert readings["OWN"].physical is not None
    assert readings["OWN"].physical.display == "4.2 A"
    assert (readings["OWN"].physical.raw, readings["OWN"].physical.number) == (50, Decimal("4.2"))
    reader.session.ratings["FE03"] = Rating(Decimal("9.1"), "A")
    again = (await reader.read(["FE03"]))["FE03"]
    assert again.physical is not None
    assert (again.text, again.physical.display) == ("50.00", "4.6 A")


async def test_only_numeric_percentages_are_converted_to_their_rating() -> None:
    profile = profile_of(
        parameter("HZ", 10, unit="Hz", scale="0.1", rating="NCR"),
        parameter("PCT", 11, unit="%", scale="1", values={"0": "off"}, rating="NCR"),
        parameter("NCR", 12, unit="A", scale="0.1", values={"9": "unknown"}),
        parameter("LOAD", 13, unit="%", scale="1", rating="NCR"),
    )
    line = OneDrive({10: 500, 11: 0, 12: 84, 13: 50})
    reader = Reader(DriveSession(line, 1, profile))
    readings = await reader.read(["HZ", "PCT", "LOAD"])
    assert [readings[code].physical for code in ("HZ", "PCT")] == [None, None]
    assert (readings["HZ"].text, readings["PCT"].text) == ("50.0", "off")
    assert readings["LOAD"].physical is not None
    line.registers[12] = 9  # a rating without a number converts nothing
    assert (await reader.read(["NCR", "LOAD"]))["LOAD"].physical is None


@pytest.mark.parametrize("priority", [Priority.POLL, Priority.OPERATOR_READ])
async def test_every_value_read_is_stored_for_the_drive(priority: Priority) -> None:
    """Values polled by Monitor are used for parameters, commands and stops."""
    line = OneDrive({10: 7, 11: 8})
    session = DriveSession(line, 1, profile_of(parameter("A", 10), parameter("B", 11)))
    await Reader(session).read(["A", "B"], priority=priority)
    assert session.image.raws == {"A": 7, "B": 8}
    line.registers[10] = 9
    await Reader(session).read(["A"], priority=priority)
    assert session.image.trusted == {"A": 9, "B": 8}


async def test_unanswered_read_is_an_error_not_a_value() -> None:
    line = OneDrive({1: 1})
    line.silence(1)
    with pytest.raises(NoAnswer):
        await Reader(DriveSession(line, 1, profile_of(parameter("P1", 1)))).read(["P1"])


class HowRead(OneDrive):
    """A drive that notes how each read is requested."""

    def __init__(self, registers: dict[int, int]) -> None:
        super().__init__(registers)
        self.how: list[dict[str, Any]] = []

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        self.how.append(how)
        return await super().read(device, address, count, **how)


@pytest.mark.parametrize("priority", [*Priority])
async def test_read_has_the_priority_of_its_caller_and_the_function_of_its_words(
    priority: Priority,
) -> None:
    line = HowRead({1: 1, 2: 2, 9: 9})
    words = (parameter("P1", 1), parameter("P2", 2), parameter("P9", 9, function=4))
    functions = [{"code": code, "name": "Read", "max_read": 20} for code in (3, 4)]
    reader = Reader(DriveSession(line, 1, profile_of(*words, functions=functions)))
    reader.max_age = 5.0
    await reader.read(["P1", "P2", "P9"], priority=priority)
    assert {how["priority"] for how in line.how} == {priority}
    assert sorted(how["function"] for how in line.how) == [3, 4]
    # only a poll may be answered by a value that another program has read
    assert {how["max_age"] > 0 for how in line.how} == {priority >= Priority.POLL}


class Planned:
    """A reader whose plans are empty; it notes the slots that they may use."""

    def __init__(self) -> None:
        self.line = OneDrive({1: 1})
        self.reader = Reader(DriveSession(self.line, 1, profile_of(parameter("P1", 1))))
        self.slots: list[object] = []
        self.answers = 0
        plans = SimpleNamespace(plan=self._plan)
        slots = SimpleNamespace(in_force=lambda: {"S1": 9}, heard=self._heard, learned=0.0)
        self.reader._plans, self.reader._slots = cast(Any, plans), cast(Any, slots)

    def _plan(self, codes: frozenset[str], slots: object = None) -> ReadPlan:
        self.slots.append(slots)
        return ReadPlan((), 0.0)

    def _heard(self) -> None:
        self.answers += 1


@pytest.mark.parametrize("priority", [*Priority])
async def test_only_polls_use_blocks_and_name_the_one_they_used(priority: Priority) -> None:
    here = Planned()
    here.reader.using = "Scanner"
    await here.reader.read(["P1"], priority=priority)
    polled = priority >= Priority.POLL
    assert here.slots[0] == ({"S1": 9} if polled else {})
    assert here.reader.using == ("" if polled else "Scanner")


async def test_each_answer_shows_that_the_drive_was_not_switched_off() -> None:
    here = Planned()
    places = [ReadRequest(1, 1, (Place("P1", 0),)) for _ in range(2)]
    await here.reader._follow(ReadPlan(tuple(places), 0.0), Priority.POLL)
    assert here.answers == 2


@pytest.mark.parametrize(
    ("values", "slot", "kept", "since"),
    [({"P1": 7.0}, 9, ["P1"], 7.0), ({"P1": 7.0}, 8, [], 7.0), ({}, 9, [], -math.inf)],
)
async def test_values_of_a_scanner_count_if_its_slots_are_as_before(
    values: dict[str, float], slot: int, kept: list[str], since: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """The slots are read after the values; a scanner that refuses has none."""
    here, sent, forgotten = Planned(), list[tuple[object, ...]](), list[int]()
    cast(Any, here.reader._slots).learned = 5.0
    cast(Any, here.reader._slots).forget = lambda: forgotten.append(1)
    block = ReadRequest(700, 1, (Place("P1", 0),))
    slots = ReadRequest(2165, 1, (Place("S1", 0),))
    answers = {700: {code: SimpleNamespace(time=time, raw=1) for code, time in values.items()},
               2165: {"S1": SimpleNamespace(time=8.0, raw=slot)}}  # fmt: skip

    async def exchange(_: object, request: Any, priority: Priority, since: float) -> Any:
        sent.append((request, priority, since))
        return dict(answers[request.address])

    monkeypatch.setattr(Reader, "_exchange", exchange)
    monkeypatch.setattr(
        Reader, "_block_of",
        lambda _, request: SimpleNamespace(name="Scanner") if request is block else None,
    )  # fmt: skip
    plan = ReadPlan((block,), 0.0, (SlotCheck(slots, {"S1": 9}, ("P1", "P2")),))
    assert list(await here.reader._follow(plan, Priority.POLL)) == kept
    assert sent == [(block, Priority.POLL, 5.0), (slots, Priority.POLL, since)]
    assert len(forgotten) == (slot != 9)
    assert here.reader.using == "Scanner"


async def test_word_of_doubtful_documents_is_read_once_and_alone() -> None:
    line = OneDrive({1: 1, 2: 2})
    functions = [{"code": 3, "name": "Read", "max_read": 20, "past_limit": "silence"}]
    words = (parameter("P1", 1), parameter("P2", 2, confidence="unverified"))
    reader = Reader(DriveSession(line, 1, profile_of(*words, functions=functions)))
    found = await reader.read(["P1", "P2"])
    assert {code: reading.raw for code, reading in found.items()} == {"P1": 1, "P2": 2}
    assert line.requested == [(1, 1), (2, 1)]
    line.requests.clear()
    await reader.read(["P1", "P2"])
    assert line.requested == [(1, 2)], "it has answered, and is like the others"


def test_line_gets_the_limits_of_the_profile() -> None:
    line = OneDrive({})
    profile = profile_of(
        parameter("P1", 1),
        functions=[
            {"code": 3, "name": "Read", "max_read": 20},
            {"code": 6, "name": "Write one", "broadcast": True},
            {"code": 16, "name": "Write", "max_write": 12},
            {"code": 23, "name": "Both", "max_read": 20, "max_write": 10},
        ],
    )
    Reader(DriveSession(line, 7, profile))
    limits = line.limits[7]
    assert limits.functions == {3, 6, 16, 23}
    assert (limits.max_read, limits.max_write) == (20, 12)
    assert (limits.max_read_23, limits.max_write_23) == (20, 10)
    assert limits.broadcast_functions == {6}


async def test_stored_plans_are_bounded() -> None:
    profile = profile_of(*(parameter(f"P{a}", a) for a in range(10, 120)))
    line = OneDrive({a: a for a in range(10, 120)})
    reader = Reader(DriveSession(line, 1, profile))
    for a in range(10, 118):
        await reader.read([f"P{a}", f"P{a + 1}"])
    assert len(reader._plans) <= PLANS_KEPT
    readings = await reader.read(["P10", "P11"])
    assert [reading.raw for reading in readings.values()] == [10, 11]


@pytest.mark.parametrize("block", [True, False])
async def test_word_of_a_block_is_certain_only_if_it_is_read_alone(
    block: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A refusal, or the word for no value, may be about another word of the block."""
    profile = profile_of(parameter("P1", 1), reading={"unknown_word": 0x8000})
    line = OneDrive({1: 0x8000})
    reader = Reader(DriveSession(line, 1, profile))
    monkeypatch.setattr(Reader, "_block_of", lambda *_: object() if block else None)
    request = ReadRequest(1, 1, (Place("P1", 0),))
    found = await reader._exchange(request, Priority.POLL)
    assert {code: reading.raw for code, reading in found.items()} == (
        {} if block else {"P1": 0x8000}
    )
    del line.registers[1]
    found = await reader._exchange(request, Priority.POLL)
    assert list(found) == ([] if block else ["P1"])
    assert all("refused" in reading.error for reading in found.values())


# -- one request of a plan -------------------------------------------------------------------------


def timed_reader(**block: object) -> tuple[Reader, OneDrive]:
    """A reader at the time 100, of a drive with words 1 and 2, and perhaps a block."""
    tables: dict[str, Any] = {"blocks": [block]} if block else {}
    profile = profile_of(parameter("P1", 1), parameter("P2", 2), parameter("S1", 50), **tables)
    line = OneDrive({1: 7, 2: 8})
    clock = cast(Any, SimpleNamespace(monotonic=lambda: 100.0, line_time=lambda time: time))
    return Reader(DriveSession(line, 1, profile, clock=clock)), line


PAIR = ReadRequest(1, 2, (Place("P1", 0), Place("P2", 1)))


def test_refusal_is_repeated_by_a_poll_after_its_time_and_a_silence_never() -> None:
    reader, _ = timed_reader()

    def refused(code: str, time: float, *, silent: bool = False) -> None:
        bad = Reading.bad(reader.profile[code], time, "none", silent=silent)
        reader.session.image.take({code: bad})

    refused("P1", 100.0 - ASK_AGAIN)
    refused("P2", 100.0 - ASK_AGAIN + 0.5)
    refused("S1", 1.0, silent=True)
    assert set(reader._still_refused(frozenset({"P1", "P2", "S1"}))) == {"P2", "S1"}
    assert set(reader._still_refused(frozenset({"P1"}))) == set()


async def test_refusal_of_several_words_concerns_none_of_them_for_certain() -> None:
    reader, line = timed_reader()
    line.registers.clear()
    assert await reader._exchange(PAIR, Priority.POLL) == {}
    (reading,) = (
        await reader._exchange(ReadRequest(1, 1, PAIR.places[:1]), Priority.POLL)
    ).values()
    assert reading.raw is None


@pytest.mark.parametrize("priority", [*Priority])
async def test_only_a_poll_takes_what_the_keeper_has_read(priority: Priority) -> None:
    reader, line = timed_reader()
    taken: list[tuple[object, float]] = []

    def take(read: object, since: float) -> Reply:
        taken.append((read, since))
        return Reply((3, 4), 99.0, b"")

    reader._polled = cast(Any, SimpleNamespace(take=take))
    found = await reader._exchange(PAIR, priority, 5.0)
    polls = priority >= Priority.POLL
    assert [reading.raw for reading in found.values()] == ([3, 4] if polls else [7, 8])
    assert taken == ([(PlannedRead(1, 2, 3), 5.0)] if polls else [])
    assert len(line.requested) == (not polls)
    assert {reading.origin for reading in found.values()} == {Origin.POLL if polls else Origin.READ}


@pytest.mark.parametrize("past_limit", ["silence", "exception"])
def test_word_of_doubtful_documents_is_apart_if_the_family_ignores_missing_ones(
    past_limit: str,
) -> None:
    functions = [{"code": 3, "name": "Read", "max_read": 20, "past_limit": past_limit}]
    words = (parameter("P1", 1), parameter("P2", 2, confidence="unverified"))
    reader = Reader(DriveSession(OneDrive({}), 1, profile_of(*words, functions=functions)))
    every, none = frozenset({"P1", "P2"}), frozenset[str]()
    apart = past_limit == "silence"
    assert reader._by_trust(every) == ((every - {"P2"}, {"P2"}) if apart else (every, none))
    reader._met.add("P2")
    assert reader._by_trust(every) == (every, none), "it has answered"


def test_shared_reply_may_be_as_old_as_what_is_known() -> None:
    reader, _ = timed_reader()
    assert reader._longest(PAIR, Priority.POLL, 5.0) == 0.0
    reader.max_age = 2.0
    assert [reader._longest(PAIR, Priority.POLL, since) for since in (5.0, 99.5, 101.0)] == [
        2.0, 0.5, 0.0,
    ]  # fmt: skip
    assert reader._longest(PAIR, Priority.OPERATOR_READ, 5.0) == 0.0
    reader.session.image.confirm("P2", 8, 99.0)
    assert reader._longest(PAIR, Priority.POLL, 5.0) == 1.0


def test_block_is_known_by_its_registers() -> None:
    reader, _ = timed_reader(
        id="block", name="Block", direction="read", address=700, min_words=1, max_words=3,
        slots=["S1"], selects_by="address", effective="at-once", choices=[], fixed_start=False,
    )  # fmt: skip

    def name(address: int) -> str | None:
        found = reader._block_of(ReadRequest(address, 1, (Place("P1", 0),)))
        return found.name if found is not None else None

    assert [name(address) for address in (699, 700, 702, 703)] == [None, "Block", "Block", None]
    assert reader._block_of(PAIR) is None
    assert reader._block_of(ReadRequest(0, 2, (Place("P1", 1),))) is None
