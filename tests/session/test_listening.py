"""Traffic of other masters, decoded by drives, codes and values, and summarized."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from tests.wire.test_observed import (
    COMMAND,
    IDENTIFY,
    READ,
    REFUSED,
    WORDS,
    reply_words,
    write_one,
)
from tui.bus.link import SerialLink
from tui.drive.profile import library
from tui.drive.read_plan import WireTiming
from tui.session.connect.address_prober import known_profiles
from tui.session.connect.known_lines import DriveMark, LineMark, LinesMemory, keep_memory
from tui.session.listening.families import Families, remembered_families
from tui.session.listening.listener import DecodedExchange, LineListener
from tui.session.listening.summary import ListeningSummary, summary_lines, summary_of
from tui.session.listening.telling import exchange_text, requested_names
from tui.wire.frames import frame, read_frame, read_write_frame, write_frame

CHARACTER = 11 / 19200
SILENCE = 3.5 * CHARACTER
TIMING = WireTiming()
PROFILES = known_profiles()


class Heard:
    """A listener, and readings that come one after the other."""

    def __init__(self, families: Families | None = None, *, times: bool = True) -> None:
        self.families = families or Families(PROFILES)
        character = CHARACTER if times else 0.0
        self.listener = LineListener(self.families, 0.0, character=character, silence=SILENCE)
        self.now = 0.0
        self.reported: list[DecodedExchange] = []

    def say(self, *readings: bytes, every: float = 0.02) -> Heard:
        """Readings at an even pace."""
        for data in readings:
            self.now += every
            self.reported += self.listener.take(data, self.now)
        return self

    def rest(self, seconds: float = 5.0) -> Heard:
        """Nothing arrives for this time."""
        self.now += seconds
        self.reported += self.listener.idle(self.now)
        return self

    @property
    def texts(self) -> list[str]:
        return [exchange_text(exchange, self.families) for exchange in self.reported]

    @property
    def summary(self) -> ListeningSummary:
        return summary_of(self.listener, self.now, TIMING)

    @property
    def lines(self) -> str:
        return "\n".join(summary_lines(self.summary))


def named(*profile_ids: str) -> Families:
    """Families of the devices 1, 2 ..., as a person names them."""
    return Families(PROFILES, {n: library.load(id) for n, id in enumerate(profile_ids, start=1)})


def values(reported: DecodedExchange) -> dict[str, str]:
    return {value.code: value.value.display for value in reported.values}


BOTH = read_write_frame(2, 3201, 2, 8501, [6])
BOTH_REPLY = reply_words(2, 0x0637, 425, function=23)


@pytest.mark.parametrize(
    ("readings", "text"),
    [
        ((READ, WORDS), "  2 read   ETA 16#0637 · RFR 42.5 Hz"),
        ((COMMAND, COMMAND), "  2 write  CMD ← 16#0006"),
        ((write_frame(2, 8501, [6, 425]), frame(2, bytes.fromhex("1021350002"))),
         "  2 write  CMD ← 16#0006 · LFR ← 42.5 Hz"),
        ((BOTH, BOTH_REPLY), "  2 read and write CMD ← 16#0006 · ETA 16#0637 · RFR 42.5 Hz"),
        ((READ, REFUSED), "  2 read   ETA RFR: exception 2. None"),
        ((READ,), "  2 read   ETA RFR: no answer"),
        ((READ, b"\x07\x07"), "  2 read   ETA RFR: damaged answer"),
        ((read_frame(2, 1, 1), reply_words(2, 7)), "  2 read   1 16#0007"),
        ((READ, WORDS, WORDS), "  2 read   a second answer to the same request"),
        ((frame(0, bytes.fromhex("0621350000")),), "all write  8501 ← 16#0000"),
        ((frame(2, bytes.fromhex("0800001234")), frame(2, bytes.fromhex("0800001234"))),
         "  2 diagnostics"),
    ],
)  # fmt: skip
def test_exchange_is_described_in_words(readings: tuple[bytes, ...], text: str) -> None:
    found = Heard(named("atv31", "atv71")).say(*readings).rest().texts
    assert any(item.startswith(text) for item in found), found


def test_identity_text_does_not_control_terminal() -> None:
    identity = frame(2, bytes.fromhex("2b0e0102000001010a") + b"\x1b[2JATV71H")
    (text,) = Heard().say(IDENTIFY, identity).texts
    assert "\x1b" not in text
    assert "␛[2JATV71H" in text


def test_refused_or_unconfirmed_values_are_null() -> None:
    heard = Heard(named("atv31", "atv71")).say(COMMAND, frame(2, b"\x86\x03"), COMMAND).rest()
    assert [exchange.values for exchange in heard.reported] == [(), ()]
    assert [requested_names(exchange) for exchange in heard.reported] == [["CMD"], ["CMD"]]


def test_family_comes_from_option_then_drive_then_memory() -> None:
    identity = frame(2, bytes.fromhex("2b0e01010000010105") + b"ATV71")
    requested = (IDENTIFY, identity, READ, WORDS)
    taken = {
        how: Heard(families).say(*requested).reported[-1].family
        for how, families in {
            "named": Families(PROFILES, {None: library.load("atv31")}, {2: "atv312"}),
            "identified": Families(PROFILES, {1: library.load("atv31")}, {2: "atv312"}),
        }.items()
    }
    assert {how: profile.how for how, profile in taken.items() if profile} == {k: k for k in taken}
    assert [profile.profile.id for profile in taken.values() if profile] == ["atv31", "atv71"]
    remembered = Heard(Families(PROFILES, None, {2: "atv312"})).say(READ, WORDS).reported[-1].family
    assert remembered is not None
    assert (remembered.how, remembered.profile.id) == ("remembered", "atv312")


def test_stored_line_names_its_drives(tmp_path: object) -> None:
    link = SerialLink("/dev/ttyS9")
    drives = {1: DriveMark(profile="atv312"), 2: DriveMark(reference="ATV71HU15M3")}
    keep_memory(LinesMemory({"serial:/dev/ttyS9": LineMark(drives={**drives, 3: DriveMark()})}))
    assert remembered_families(link) == {1: "atv312", 2: "atv71"}
    assert remembered_families(SerialLink("/dev/ttyS8")) == {}


def test_identity_without_a_reference_replaces_none() -> None:
    families = Families(PROFILES)
    for text, kept in (("", ""), ("ATV71", "ATV71"), ("", "ATV71"), ("ATV31", "ATV31")):
        objects = b"".join(
            bytes([n, len(part)]) + part for n, part in ((0, b"S"), (1, text.encode()))
        )
        reply = bytes.fromhex("2b0e01010000") + b"\2" + objects
        Heard(families).say(IDENTIFY, frame(2, reply))
        assert families.identities[2].reference == kept


def reads_of(profile_id: str, codes: Iterable[str]) -> list[bytes]:
    """Single reads of parameters with their replies."""
    profile = library.load(profile_id)
    found = []
    for code in codes:
        parameter = profile[code]
        found += [
            frame(2, bytes([parameter.function, *parameter.address.to_bytes(2, "big"), 0, 1])),
            reply_words(2, 1, function=parameter.function),
        ]
    return found


@pytest.mark.parametrize(
    ("profile_id", "codes", "others"),
    [
        ("atv21", ("FD01", "FD00", "FA01"), ()),
        ("atv71", ("ETA", "RFR", "UOP", "THR1"), ()),
        ("powerdrive", ("10.40", "1.21"), None),
    ],
)
def test_likely_family_follows_from_the_replies(
    profile_id: str, codes: tuple[str, ...], others: tuple[str, ...] | None
) -> None:
    family = Heard().say(*reads_of(profile_id, codes)).reported[-1].family
    assert family is not None
    assert family.how == "likely"
    if others is not None:
        assert (family.profile.id, family.others) == (profile_id, others)
    else:
        assert profile_id in (family.profile.id, *family.others)


def test_equally_likely_families_are_named() -> None:
    heard = Heard().say(READ, WORDS)
    family = heard.reported[-1].family
    assert family is not None
    assert {family.profile.id, *family.others} == {"atv31", "atv312", "atv71"}
    assert f"(likely, or {', '.join(family.others)})" in heard.lines


def test_read_beyond_the_limits_excludes_a_family() -> None:
    words = [0] * 40
    heard = Heard().say(read_frame(2, 3201, 40), reply_words(2, *words))
    family = heard.reported[-1].family
    assert family is None or family.profile.id == "atv71"


def test_no_family_is_likely_if_none_matches() -> None:
    heard = Heard().say(read_frame(2, 60000, 1), reply_words(2, 7))
    assert heard.reported[-1].family is None
    assert "Device 2: family unknown; name it with -p" in heard.lines


def cycle(heard: Heard, times: int, *readings: bytes, every: float = 0.02) -> Heard:
    for _ in range(times):
        heard.say(*readings, every=every)
    return heard


def test_masters_are_commanding_or_reading() -> None:
    heard = Heard(named("atv71", "atv71"))
    run = [write_one(1, 8501, 0x000F)] * 2 + [write_one(1, 8502, 425)] * 2
    cycle(heard, 3, *run, READ, WORDS)
    first, second = heard.summary.drives
    assert (first.tally.commanded, second.tally.commanded) == (True, False)
    assert "commanded by the master: CMD 16#000F every 0.12 s, LFR 42.5 Hz every" in heard.lines
    assert "read only: the master on this line does not command it" in heard.lines


def test_written_setting_is_not_a_command() -> None:
    heard = Heard(named("atv71", "atv71")).say(*[write_one(2, 9001, 30)] * 2)
    (drive,) = heard.summary.drives
    assert not drive.tally.commanded
    assert "  written: ACC 30 raw once" in heard.lines


def test_polling_interval_of_a_drive_is_reported() -> None:
    heard = cycle(Heard(named("atv71", "atv71")), 11, READ, WORDS, every=0.05)
    (drive,) = heard.summary.drives
    assert drive.pace == pytest.approx(10.0)
    assert drive.tally.longest_pause == pytest.approx(0.1)
    assert "polled 10.0 times a second, longest pause 0.10 s" in heard.lines


@pytest.mark.parametrize(
    ("pause", "reported"),
    [
        (2.0, "TTO 3 s (as read on the line): polled in time, 0.9"),
        (4.0, "TTO 3 s (as read on the line): NOT POLLED"),
    ],
)
def test_polling_within_the_timeout_is_reported(pause: float, reported: str) -> None:
    heard = Heard(named("atv71", "atv71")).say(COMMAND, COMMAND)
    place = library.load("atv71")["TTO"].address
    heard.say(read_frame(2, place, 1), reply_words(2, 30), READ, WORDS)
    heard.now += pause
    assert reported in heard.say(READ, WORDS).lines
    (drive,) = heard.summary.drives
    assert drive.feeding is not None
    assert drive.feeding.fed is (pause < 3)


def test_pause_in_progress_counts() -> None:
    heard = Heard(named("atv312", "atv312")).say(READ, WORDS)
    assert "factory setting; no master has read it): polled in time" in heard.lines
    assert "NOT POLLED" in heard.rest(11.0).lines


def test_timeout_that_starts_with_a_command_is_inactive_before() -> None:
    heard = Heard(named("atv71", "atv71")).say(READ, WORDS)
    assert "starts with the first command; none was heard while listening" in heard.lines
    assert "it has expired" not in heard.lines
    assert "If one was sent before, it has expired" in heard.rest(11.0).lines


def test_unanswered_request_does_not_restart_the_timeout() -> None:
    heard = Heard(named("atv312", "atv312")).say(READ, WORDS)
    cycle(heard, 6, READ, every=2.0)
    assert "NO ANSWERED REQUEST for" in heard.lines
    assert "longest pause 2.0" in heard.lines


def test_damaged_reply_restarts_the_timeout() -> None:
    heard = Heard(named("atv312", "atv312")).say(READ, WORDS)
    cycle(heard, 3, READ, WORDS[:4], every=3.0)
    assert "polled in time" in heard.lines


def test_unread_timeout_is_named_beside_one_that_is_off() -> None:
    profile = library.load("powerdrive")
    rules = profile.data.communication_fault
    assert rules is not None
    off, other = profile[rules.timeout], rules.other_timeouts[0]
    heard = Heard(named("powerdrive", "powerdrive")).say(READ, WORDS)
    heard.say(read_frame(2, off.address, 1), reply_words(2, rules.off or 0))
    assert f"no master has read {other}" in heard.lines
    assert "does not react" not in heard.lines


@pytest.mark.parametrize(("waited", "answers"), [(0.6, ["none"]), (0.2, [])])
def test_open_request_is_reported_with_its_wait(waited: float, answers: list[str]) -> None:
    heard = Heard().say(READ)
    found = heard.listener.end(heard.now + waited)
    assert [exchange.exchange.answer for exchange in found] == answers


def test_two_drives_at_one_address_are_reported() -> None:
    heard = cycle(Heard(named("atv71", "atv71")), 3, READ, WORDS, WORDS)
    assert "TWO ANSWERS to 3 requests: do two devices have the address 2?" in heard.lines


def test_exceptions_and_silence_are_reported() -> None:
    heard = Heard(named("atv71", "atv71")).say(READ, WORDS, READ, REFUSED, READ, REFUSED)
    heard.say(read_frame(9, 3201, 1)).rest()
    assert "refused 2 times with exception 2: " in heard.lines
    assert "Device 9: family unknown; name it with -p\n  no answer to 1 request" in heard.lines


def test_overlapping_requests_indicate_a_second_master() -> None:
    heard = cycle(Heard(), 3, READ + read_frame(3, 3201, 1), reply_words(3, 7))
    assert "A SECOND MASTER? 3 requests began while another request still waited" in heard.lines
    patient = cycle(Heard(), 3, READ, read_frame(3, 3201, 1), reply_words(3, 7), every=0.1)
    assert "SECOND MASTER" not in patient.lines


def test_damaged_frames_and_gaps_are_reported() -> None:
    heard = Heard()
    heard.say(READ, WORDS[:4], WORDS[4:], every=0.02)
    assert "Broken frames: 1 frame with an internal pause of up to 17.1 ms" in heard.lines
    hasty = Heard().say(READ)
    hasty.say(WORDS, every=len(WORDS) * CHARACTER + SILENCE / 4)
    assert "Broken gaps: 1 frame began too soon after another" in hasty.lines
    kept = Heard().say(READ, WORDS)
    assert "The gaps between frames are long enough." in kept.lines
    assert "The gaps between frames" not in Heard().say(b"\x33\x44").lines


def test_gaps_are_not_judged_if_not_measurable() -> None:
    heard = Heard(times=False).say(READ, WORDS[:4], WORDS[4:])
    assert "Gaps between frames are not checked" in heard.lines
    assert "The gaps between frames" not in heard.lines
    assert heard.summary.tally.cut == 0
    together = Heard().say(READ + WORDS, READ + WORDS)
    assert "several frames at once: the gaps between them are unknown" in together.lines


def test_shorter_read_plan_is_suggested() -> None:
    heard = Heard(named("atv71", "atv71"))
    singles = [
        data
        for address in (3201, 3202, 3204)
        for data in (read_frame(2, address, 1), reply_words(2, 1))
    ]
    cycle(heard, 3, *singles)
    (drive,) = heard.summary.drives
    assert drive.shorter is not None
    assert len(drive.shorter.now) == 3
    assert [(request.address, request.count) for request in drive.shorter.plan.requests] == [
        (3201, 4)
    ]
    assert drive.shorter.plan.seconds < drive.shorter.now_seconds
    assert "the master reads ETA, RFR, LCR in 3 requests" in heard.lines


def test_no_plan_is_suggested_if_the_master_reads_well() -> None:
    heard = cycle(
        Heard(named("atv71", "atv71")), 3, read_frame(2, 3201, 4), reply_words(2, *[1] * 4)
    )
    (drive,) = heard.summary.drives
    assert drive.shorter is None


def test_rare_reads_are_not_part_of_the_cycle() -> None:
    heard = Heard(named("atv71", "atv71"))
    heard.say(read_frame(2, 3204, 1), reply_words(2, 1))
    cycle(heard, 5, read_frame(2, 3201, 2), reply_words(2, 1, 1))
    (drive,) = heard.summary.drives
    assert drive.shorter is None


def test_silence_and_noise_are_reported() -> None:
    assert "Nothing was received" in Heard().rest().lines
    noise = Heard().say(b"\xff\x00\xff").rest()
    assert (
        "3 bytes received, but no whole frame. Check the baud rate and the format." in noise.lines
    )
    both = Heard().say(READ, WORDS, b"\xff\x00\xff").rest()
    assert "Bytes outside frames: 3, in 1 place" in both.lines


def test_scale_follows_values_seen_from_the_same_drive() -> None:
    """A value whose scale follows another word is raw until that was received."""
    profile = next(p for p in PROFILES if any(item.scale_by for item in p.parameters))
    entry = next(p for p in profile.parameters if p.scale_by and "r" in p.access)
    assert entry.scale_by is not None
    source = profile[entry.scale_by.parameter]
    heard = Heard(Families(PROFILES, {None: profile}))

    def read(parameter: object, word: int) -> None:
        address = parameter.address  # type: ignore[attr-defined]
        heard.say(read_frame(2, address, 1), reply_words(2, word))

    read(entry, 100)
    assert heard.reported[-1].values[0].value.unit == "raw"
    read(source, int(next(iter(entry.scale_by.scales))))
    read(entry, 100)
    assert heard.reported[-1].values[0].value.unit != "raw"
