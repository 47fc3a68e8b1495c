"""Values as drives of other makes have them: floats, offsets, negative scales, words of 32 bits."""

from __future__ import annotations

import struct
from decimal import Decimal

import pytest
from click.testing import CliRunner

from tests.mixer import COMMAND, HERTZ, MIXER, installed_mixer
from tui.cli.main import main
from tui.drive.chart import read_chart
from tui.drive.errors import ValueRefused
from tui.drive.first_stop import blind_stops
from tui.drive.foreign_write import WordKind, classify_words, half_refusal, starts_by
from tui.drive.profile import library
from tui.drive.profile.stop_profile import stop_profile_of
from tui.drive.settings.edits import Edits
from tui.drive.settings.in_force import limits_in_force
from tui.drive.settings.limits import edit_problems
from tui.drive.shown import number_of, raw_of_text, shown
from tui.drive.values import NOT_A_NUMBER, from_words, to_words
from tui.session.drive import DriveSession
from tui.session.read.reader import Reader
from tui.session.record.decoding import HistoryPoint, joined_points
from tui.session.record.runs import _kind_of
from tui.simulator import DriveSpec, SimulatedDrive
from tui.simulator.proving.proof_steps import prove_profile

from .fakes import OneDrive
from .test_command import bench

ROW = """
[[parameters]]
code = "{0}"
name = "Word {0}"
number = "4{1}"
address = {2}
group = "Settings"
source = "guide"
confidence = "manual"
"""
TEMP = ROW.format("TEMP", 300, 300) + 'access = "r"\nunit = "°C"\nscale = "0.5"\noffset = "-40"\n'
SLIP = (
    ROW.format("SLIP", 301, 301)
    + 'access = "rw"\nunit = "%"\nscale = "-0.1"\nmin = 0\nmax = 500\nfactory = 0\n'
)
FLOW = (
    ROW.format("FLOW", 302, 302) + 'access = "rw"\nunit = "m/s"\nscale = "0.01"\nmin = -500\n'
    'max = 1000\nfactory = 0\ntype = "float32"\nlow_word_first = false\n'
)
WAY = '[[references]]\nparameter = "REF"\nkind = "frequency"\n\n'
ROWS = TEMP + SLIP + FLOW


@pytest.mark.parametrize(
    ("code", "raw", "text"),
    [
        ("TEMP", 0, "-40.0 °C"),
        ("TEMP", 125, "22.5 °C"),
        ("SLIP", 25, "-2.5 %"),
        ("FLOW", -125, "-1.25 m/s"),
        ("FLOW", NOT_A_NUMBER, "not a number"),
    ],
)
def test_value_is_shown_with_its_offset_and_sign(code: str, raw: int, text: str) -> None:
    profile = installed_mixer(more=ROWS)
    assert shown(profile, profile[code], raw, {}).display == text


def test_typed_value_with_an_offset_or_a_negative_scale_leads_to_its_count() -> None:
    profile = installed_mixer(more=ROWS)
    assert raw_of_text(profile, profile["TEMP"], "22.5", {}).raw == 125
    assert raw_of_text(profile, profile["SLIP"], "-2.5", {}).raw == 25
    with pytest.raises(ValueRefused, match=r"out of range, -50\.0 % to 0\.0 %"):
        raw_of_text(profile, profile["SLIP"], "2.5", {})
    limits = limits_in_force(profile, profile["SLIP"], {})
    assert limits is not None
    assert (limits.low, limits.high) == (Decimal("-50.0"), Decimal(0))
    assert limits.step == Decimal("0.1")


@pytest.mark.parametrize("number", [0.0, 12.5, -1.25, 9.99])
def test_float_is_read_and_written_as_its_own_bits(number: float) -> None:
    flow = installed_mixer(more=ROWS)["FLOW"]
    words = struct.unpack(">HH", struct.pack(">f", number))
    raw = from_words(flow, words)
    assert raw == round(number * 100)
    assert to_words(flow, raw) == words


@pytest.mark.parametrize("number", [float("nan"), float("inf"), 3e9])
def test_float_that_is_no_number_is_neither_shown_nor_written(number: float) -> None:
    profile = installed_mixer(more=ROWS)
    flow = profile["FLOW"]
    raw = from_words(flow, struct.unpack(">HH", struct.pack(">f", number)))
    assert raw == NOT_A_NUMBER
    assert number_of(profile, flow, raw, {}) is None
    with pytest.raises(ValueRefused):
        to_words(flow, raw)


def test_float_has_the_word_order_of_its_family() -> None:
    order = ("\n[[charts]]", "\n[reading]\nlow_word_first = false\n\n[[charts]]")
    rows = FLOW.replace("low_word_first = false\n", "")
    assert not installed_mixer(HERTZ, rows, order)["FLOW"].low_word_first


def test_float_too_fine_for_its_words_is_refused() -> None:
    flow = installed_mixer(more=ROWS)["FLOW"]
    assert to_words(flow, 1 << 24)
    with pytest.raises(ValueRefused, match="cannot hold it exactly"):
        to_words(flow, (1 << 30) + 1)


def test_values_are_written_verified_and_backed_up_by_the_command_line() -> None:
    installed_mixer(more=ROWS)
    line = [f"sim:{MIXER}", "-p", MIXER]
    wrote = CliRunner().invoke(main, ["write", *line, "FLOW=2.25", "SLIP=-2.5", "--arm"])
    assert wrote.exit_code == 0, wrote.output
    over = CliRunner().invoke(main, ["write", *line, "FLOW=10.01", "--arm"])
    assert over.exit_code == 2, over.output
    assert "-5.00 m/s to 10.00 m/s" in over.output
    saved = CliRunner().invoke(main, ["backup", *line[:1], "-", *line[1:]])
    assert saved.exit_code == 0, saved.output
    assert "FLOW" in saved.output


MODELS = (
    ROW.format("MODEL", 320, 320)
    + 'access = "r"\n'
    + ROW.format("LIMIT", 321, 321)
    + (
        'access = "rw"\nunit = "A"\nscale = "0.1"\nmin = 0\nmax = 200\n'
        'max_of = { parameter = "MODEL", raws = { 1 = 42, 2 = 75 } }\n'
    )
)


@pytest.mark.parametrize(("model", "most"), [(1, "4.2"), (2, "7.5"), (3, "20.0")])
def test_model_of_a_family_has_its_own_limit(model: int, most: str) -> None:
    profile = installed_mixer(more=MODELS)
    raws = {"MODEL": model, "LIMIT": 10}
    limits = limits_in_force(profile, profile["LIMIT"], raws)
    assert limits is not None
    assert limits.high == Decimal(most)
    above = Edits().stage(profile, "LIMIT", "8", raws)
    problems = edit_problems(profile, above, raws)
    assert ("above" in problems.get("LIMIT", "")) is (model < 3)
    drive = SimulatedDrive(profile, DriveSpec(MIXER, 1, sets={"MODEL": model}))
    drive.line_side.answer(1, struct.pack(">BHH", 6, 321, 80))
    held = drive.line_side.answer(1, struct.pack(">BHH", 3, 321, 1))
    assert (held != struct.pack(">BBH", 3, 2, 80)) is (model < 3)


WIDE_STATUS = (
    ("address = 100\n", 'address = 240\ntype = "uint32"\n'),
    ("mask = 0x0002, value = 0x0002", "mask = 0x20000, value = 0x20000"),
    ("mask = 0x0001, value = 0x0001", "mask = 0x10000, value = 0x10000"),
)


async def test_status_word_of_32_bits_shows_the_state_of_a_run_and_a_stop() -> None:
    installed_mixer(HERTZ, "", *WIDE_STATUS)
    async with bench(MIXER) as made:
        assert made.session.state(60).kind == "ready"
        made.commander.run("forward", "20Hz")
        assert await made.done() == "Run: Running"
        await made.let_go_until(lambda: made.drive.motor.frequency > 19)
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        assert made.writes()[-1] == (COMMAND, 0)


def test_bits_above_15_are_shown_with_all_their_digits() -> None:
    bits = 'bits = [{ bit = 17, name = "Dry", alarm = true }]\n'
    profile = installed_mixer(
        more=ROW.format("WIDE", 310, 310) + f'access = "r"\ntype = "uint32"\n{bits}'
    )
    assert shown(profile, profile["WIDE"], 0x20001, {}).text == "16#00020001"
    drive = SimulatedDrive(library.load(MIXER), DriveSpec(MIXER, 1, sets={"WIDE": 0x20001}))
    assert drive.line_side.answer(1, struct.pack(">BHH", 3, 310, 2)) == struct.pack(
        ">BBHH", 3, 4, 1, 2
    )


WIDE_COMMAND = (
    ("address = 200\n", 'address = 230\ntype = "uint32"\nlow_word_first = false\n'),
    ("words = [1]", "words = [0x10000]"),
    ("words = [3]", "words = [0x30000]"),
    ("words = [0]", "words = [0x80000001]"),
)
"""All run commands differ from the stop in bits 16 to 31 only, high word first."""
WIDE = 230


async def test_command_word_of_32_bits_runs_and_stops_in_whole_frames() -> None:
    installed_mixer(HERTZ, "", *WIDE_COMMAND)
    async with bench(MIXER) as made:
        made.commander.run("forward", "20Hz")
        assert await made.done() == "Run: Running"
        await made.let_go_until(lambda: made.drive.motor.frequency > 19)
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        written = [
            frame.data[7:11].hex(" ", 2)
            for frame in made.line.trace
            if frame.direction == "out" and frame.data[1:4] == bytes([16, 0, WIDE])
        ]
    assert written == ["0001 0000", "8000 0001"]


def test_prepared_and_first_stop_of_32_bits_have_both_words() -> None:
    profile = installed_mixer(HERTZ, "", *WIDE_COMMAND)
    (word,) = blind_stops([stop_profile_of(profile)])
    assert (word.address, word.word, word.values) == (WIDE, 0x80000001, (0x8000, 1))
    other = installed_mixer(HERTZ, "", ("address = 200\n", "address = 230\n"))
    assert blind_stops([stop_profile_of(profile), stop_profile_of(other)]) == []


@pytest.mark.parametrize(
    ("words", "kind", "start"),
    [
        ({WIDE: 0x8000, WIDE + 1: 1}, WordKind.STOP, None),
        ({WIDE: 0x8000}, WordKind.COMMAND, "forward"),
        ({WIDE + 1: 1}, WordKind.COMMAND, "forward"),
        ({WIDE: 1, WIDE + 1: 0}, WordKind.COMMAND, "forward"),
        ({WIDE: 3, WIDE + 1: 0}, WordKind.COMMAND, "reverse"),
        ({WIDE: 1, WIDE + 1: 0x8000}, WordKind.COMMAND, "forward"),
    ],
)
def test_half_of_a_command_word_of_32_bits_is_no_stop_of_a_client(
    words: dict[int, int], kind: WordKind, start: str | None
) -> None:
    profile = installed_mixer(HERTZ, "", *WIDE_COMMAND)
    found = classify_words(profile, words, {})
    assert {word.kind for word in found} == {kind}
    assert starts_by(profile, found) == start
    half = half_refusal(profile["CTRL"], words)
    assert bool(half) is (len(words) == 1)


def test_profile_with_a_command_word_of_32_bits_proves_itself() -> None:
    ways = ('[[parameters]]\ncode = "STAT"', f'{WAY}[[parameters]]\ncode = "STAT"')
    profile = installed_mixer(HERTZ, "", *WIDE_COMMAND, ways)
    assert {step.title: step.fault for step in prove_profile(profile) if step.fault} == {}


TWO_WORDS = (
    (
        'kind = "running", mask = 0x0002, value = 0x0002 }',
        'kind = "running", mask = 0x0002, value = 0x0002,'
        ' also = [{ parameter = "STAT2", mask = 0x0300, values = [0x0100, 0x0200] }] },\n'
        '  { id = "held", name = "Held", kind = "stopped", mask = 0x0002, value = 0x0002 }',
    ),
    ('states = ["ready", "running"]', 'states = ["ready", "running", "held"]'),
)
"""The motor runs if one word says so and another one agrees."""
STATUS_2 = ROW.format("STAT2", 103, 103) + 'access = "r"\n'


@pytest.mark.parametrize(
    ("raws", "state"),
    [
        ({"STAT": 2, "STAT2": 0x100}, "running"),
        ({"STAT": 2, "STAT2": 0x8200}, "running"),
        ({"STAT": 2, "STAT2": 0x300}, "held"),
        ({"STAT": 2}, "unknown"),
        ({"STAT": 1}, "ready"),
        ({"STAT2": 0x100}, "unknown"),
    ],
)
def test_state_of_two_words_is_unknown_until_the_deciding_one_is_read(
    raws: dict[str, int], state: str
) -> None:
    profile = installed_mixer(HERTZ, STATUS_2, *TWO_WORDS)
    assert read_chart(profile, {"TRIP": 0, **raws}).state.id == state


async def test_state_of_two_words_is_read_from_both_in_a_run_and_a_stop() -> None:
    installed_mixer(HERTZ, STATUS_2, *TWO_WORDS)
    async with bench(MIXER) as made:
        made.commander.run("forward", "20Hz")
        assert await made.done() == "Run: Running"
        await made.let_go_until(lambda: made.drive.motor.frequency > 19)
        assert made.drive.raw("STAT2") & 0x300
        made.session.image.doubt("STAT2")
        assert made.session.state(60).kind == "unknown"
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        assert made.writes()[-1] == (COMMAND, 0)


def test_profile_with_a_state_of_two_words_proves_itself() -> None:
    ways = ('[[parameters]]\ncode = "STAT"', f'{WAY}[[parameters]]\ncode = "STAT"')
    profile = installed_mixer(HERTZ, STATUS_2, *TWO_WORDS, ways)
    assert {step.title: step.fault for step in prove_profile(profile) if step.fault} == {}


async def test_standstill_is_not_noted_from_a_new_and_an_old_word() -> None:
    profile = installed_mixer(HERTZ, STATUS_2, *TWO_WORDS)
    line = OneDrive({100: 2, 103: 0x300, 102: 0})
    session = DriveSession(line, 1, profile)
    await Reader(session).read(["STAT2", "TRIP"])
    before = session.rest_seen
    await Reader(session).read(["STAT"])
    assert session.rest_seen == before
    await Reader(session).read(["STAT", "STAT2"])
    assert session.rest_seen > before


def test_record_of_a_state_of_two_words_has_a_state_only_if_both_were_read() -> None:
    profile = installed_mixer(HERTZ, STATUS_2, *TWO_WORDS)
    (chart,) = profile.data.charts
    status = [HistoryPoint(time, time, 2, 2, 2) for time in (10.0, 20.0, 200.0)]
    further = [HistoryPoint(time, time, raw, raw, raw) for time, raw in ((15.0, 256), (21.0, 768))]
    found = list(joined_points(status, further, 32))
    kinds = [None if p.least is None else _kind_of(chart, int(p.least)) for p in found]
    assert kinds == [None, "stopped", None]
    assert [
        _kind_of(chart, int(p.least or 0)) for p in joined_points(status[1:2], further[:1], 32)
    ] == ["running"]
