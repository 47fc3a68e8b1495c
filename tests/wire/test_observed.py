"""Traffic of other masters: bytes into frames, frames into exchanges."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.simulator.manual import FRAMES, Frame
from tui.wire.frames import frame, is_whole, read_frame, read_write_frame, write_frame
from tui.wire.observed.pairing import ObservedExchange, Pairing
from tui.wire.observed.splitting import FrameSplitter, ObservedFrame, whole_length

CHARACTER = 11 / 19200
WORD = st.integers(0, 0xFFFF)
DEVICE = st.integers(1, 247)


def reply_words(device: int, *words: int, function: int = 3) -> bytes:
    """The reply of a read."""
    return frame(
        device,
        bytes([function, 2 * len(words)]) + b"".join(word.to_bytes(2, "big") for word in words),
    )


def write_one(device: int, address: int, word: int) -> bytes:
    return frame(device, b"\x06" + address.to_bytes(2, "big") + word.to_bytes(2, "big"))


def split(*readings: bytes, every: float = 0.01, pause: bool = True) -> list[ObservedFrame]:
    """Frames of readings that come at an even pace."""
    pairing = Pairing()
    splitter = FrameSplitter(CHARACTER, pairing.is_due)
    found = []
    for number, data in enumerate(readings):
        for piece in splitter.take(data, number * every):
            pairing.take(piece)
            found.append(piece)
    return found + (list(splitter.pause()) if pause else [])


def heard(*readings: bytes, every: float = 0.01, until: float = 10.0) -> list[ObservedExchange]:
    """Exchanges of readings that come at an even pace, and then nothing."""
    pairing = Pairing()
    found = []
    for piece in split(*readings, every=every):
        found += pairing.take(piece)[0]
    return found + pairing.wait(until)


READ, WORDS = read_frame(2, 3201, 2), reply_words(2, 0x0637, 425)
COMMAND = write_one(2, 8501, 6)
REFUSED = frame(2, b"\x83\x02")
BOTH = read_write_frame(2, 3201, 2, 8501, [6])
BOTH_REPLY = reply_words(2, 0x0637, 425, function=23)
IDENTIFY = frame(2, bytes.fromhex("2b0e0100"))
IDENTITY = frame(2, bytes.fromhex("2b0e01010000010003") + b"ATV")
UNKNOWN = frame(2, bytes([90, 1, 2, 3]))


@given(
    st.lists(
        st.tuples(DEVICE, WORD, st.lists(WORD, min_size=1, max_size=60)), min_size=1, max_size=6
    ),
    st.randoms(use_true_random=False),
)
def test_frames_are_found_in_any_chunks(
    reads: list[tuple[int, int, list[int]]], chance: random.Random
) -> None:
    frames = [
        item
        for device, address, words in reads
        for item in (read_frame(device, address, len(words)), reply_words(device, *words))
    ]
    data = b"".join(frames)
    cuts = sorted(chance.randrange(len(data) + 1) for _ in range(chance.randrange(8)))
    readings = [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]
    found = split(*readings)
    assert [frame.data for frame in found if frame.whole] == frames
    assert all(frame.whole for frame in found)


def test_reply_complete_without_its_last_byte_includes_it() -> None:
    request, reply = read_frame(160, 7, 2), reply_words(160, 1040, 1040)
    assert is_whole(reply[:-1])
    assert [frame.data for frame in split(request, reply + READ)] == [request, reply, READ]
    assert [frame.data for frame in split(request, reply[:-1], reply[-1:])] == [request, reply]


def test_request_that_looks_like_a_shorter_reply_is_found_whole() -> None:
    request, reply = read_frame(70, 531, 1), reply_words(70, 0)
    assert is_whole(request[:-1])
    dribbled = [bytes([byte]) for byte in request + reply]
    assert [frame.data for frame in split(*dribbled, every=CHARACTER)] == [request, reply]


def test_repeated_request_is_found_while_its_reply_is_due() -> None:
    found = split(READ, READ, WORDS, pause=False, every=0.2)
    assert [frame.data for frame in found] == [READ, READ, WORDS]


@pytest.mark.parametrize("example", FRAMES, ids=lambda f: f"{f.family}-{f.number}")
def test_every_manual_frame_is_found(example: Frame) -> None:
    (found,) = split(example.data)
    assert (found.data, found.whole) == (example.data, True)


@pytest.mark.parametrize(
    "data", [READ, WORDS, COMMAND, REFUSED, BOTH, BOTH_REPLY, IDENTIFY, IDENTITY,
             write_frame(2, 8501, [6, 7]), frame(2, bytes.fromhex("1000ff0002"))]
)  # fmt: skip
def test_each_kind_of_frame_is_found_byte_by_byte(data: bytes) -> None:
    readings = [bytes([byte]) for byte in data + READ]
    assert [heard_frame.data for heard_frame in split(*readings, every=CHARACTER)] == [data, READ]


def test_frame_of_an_unknown_function_ends_at_a_pause() -> None:
    assert split(UNKNOWN, pause=False) == []
    (found,) = split(UNKNOWN)
    assert (found.data, found.whole) == (UNKNOWN, True)


@given(st.binary(min_size=1, max_size=20))
def test_noise_before_a_request_ends_at_a_pause(noise: bytes) -> None:
    found = split(noise, READ, WORDS)
    assert b"".join(frame.data for frame in found) == noise + READ + WORDS
    assert [frame.data for frame in found if frame.whole][-2:] == [READ, WORDS]


def test_truncated_reply_does_not_hide_the_next_request() -> None:
    found = split(READ, WORDS[:5], READ, pause=False)
    assert [(frame.data, frame.whole) for frame in found] == [
        (READ, True),
        (WORDS[:5], False),
        (READ, True),
    ]


@pytest.mark.parametrize("noise", [b"\x00", b"\x00\x5a", b"\x02\x10\x00"])
def test_noise_just_before_a_request_does_not_hide_it(noise: bytes) -> None:
    """An adapter has delivered both together; the reply follows a gap."""
    found = split(noise + READ, WORDS, pause=False)
    assert [frame.data for frame in found] == [noise, READ, WORDS]


def test_damaged_frame_is_dropped() -> None:
    splitter = FrameSplitter()
    noise = bytes([0x55, 0x55]) * 3000
    given = b"".join(frame.data for frame in splitter.take(noise, 0.0))
    assert len(given) > 4000
    assert given + b"".join(frame.data for frame in splitter.pause()) == noise
    assert not splitter.waiting


def test_pauses_are_measured_if_reads_show_them() -> None:
    splitter = FrameSplitter(CHARACTER)
    (request,) = list(splitter.take(READ, 1.0))
    assert request.begun == pytest.approx(1.0 - 8 * CHARACTER)
    reply = [*splitter.take(WORDS[:4], 1.010), *splitter.take(WORDS[4:], 1.020)]
    assert reply[0].pause == pytest.approx(0.010 - 4 * CHARACTER)
    assert reply[0].gap == pytest.approx(0.010 - 5 * CHARACTER)
    together = list(splitter.take(READ + WORDS, 2.0))
    assert [frame.pause is None for frame in together] == [False, True]


def test_one_read_of_several_frames_shows_no_gap() -> None:
    assert [frame.gap for frame in split(READ + WORDS + READ)] == [0.0, 0.0, 0.0]


def answers(*readings: bytes, every: float = 0.01) -> list[tuple[int, int, str]]:
    return [
        (exchange.device, exchange.function, exchange.answer)
        for exchange in heard(*readings, every=every)
    ]


@pytest.mark.parametrize(
    ("readings", "reported"),
    [
        ((READ, WORDS), [(2, 3, "ok")]),
        ((READ + WORDS,), [(2, 3, "ok")]),
        ((READ, REFUSED), [(2, 3, "exception")]),
        ((READ,), [(2, 3, "none")]),
        ((READ, READ, WORDS), [(2, 3, "none"), (2, 3, "ok")]),
        ((READ, b"\x00\x01", READ, WORDS), [(2, 3, "damaged"), (2, 3, "ok")]),
        ((COMMAND, COMMAND), [(2, 6, "ok")]),
        ((COMMAND, COMMAND, COMMAND, COMMAND), [(2, 6, "ok"), (2, 6, "ok")]),
        ((write_one(0, 8501, 6), READ, WORDS), [(0, 6, "broadcast"), (2, 3, "ok")]),
        ((BOTH, BOTH_REPLY), [(2, 23, "ok")]),
        ((IDENTIFY, IDENTITY), [(2, 43, "ok")]),
        ((READ, WORDS, WORDS), [(2, 3, "ok"), (2, 3, "again")]),
        ((COMMAND, COMMAND, COMMAND, READ, WORDS), [(2, 6, "ok"), (2, 6, "again"), (2, 3, "ok")]),
        ((WORDS, READ, WORDS), [(2, 3, "unasked"), (2, 3, "ok")]),
        # a late reply of one drive does not affect the current request
        (
            (READ, read_frame(3, 3201, 2), WORDS, reply_words(3, 7, 8)),
            [(2, 3, "none"), (2, 3, "unasked"), (3, 3, "ok")],
        ),
        # a reply of another length belongs to another request
        ((READ, reply_words(2, 1)), [(2, 3, "unasked"), (2, 3, "none")]),
    ],
)
def test_requests_have_their_results(
    readings: tuple[bytes, ...], reported: list[tuple[int, int, str]]
) -> None:
    assert answers(*readings) == reported


def test_repeated_write_is_not_a_reply() -> None:
    assert answers(COMMAND, COMMAND, every=0.5) == [(2, 6, "none"), (2, 6, "none")]


def test_exchange_has_its_times_and_words() -> None:
    (exchange,) = heard(READ, WORDS, every=0.02)
    assert exchange.turnaround == pytest.approx(0.02 - len(WORDS) * CHARACTER)
    assert (exchange.request, exchange.reply) == (READ[1:-2], WORDS[1:-2])
    (refused,) = heard(READ, REFUSED)
    assert refused.exception == 2


def test_cost_of_noise_does_not_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """At a wrong baud rate all is noise, byte after byte."""
    looked: list[int] = []

    def counted(data: bytes | bytearray) -> int:
        looked.append(len(data))
        return whole_length(data)

    monkeypatch.setattr("tui.wire.observed.splitting.whole_length", counted)
    splitter, chance, noise = FrameSplitter(CHARACTER), random.Random(1), 2000
    for number in range(noise):
        list(splitter.take(chance.randbytes(1), number * CHARACTER))
    assert len(looked) < 4 * noise
