"""Commands as a sequence of words with waits: they are bounded, and a stop never waits for them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.mixer import COMMAND, HERTZ, MIXER, installed_mixer, mixer_text
from tui.bus.errors import NoAnswer
from tui.drive.profile import library
from tui.drive.profile.check import examined
from tui.drive.profile.schema import OrderId
from tui.session.command.access import HalfSent
from tui.session.command.stop_report import OVER, Phase
from tui.session.fleet import Fleet
from tui.session.running.watching import outcome_of
from tui.session.work import OutcomeKind
from tui.simulator.proving.proof_bench import ProofBench
from tui.simulator.proving.proof_steps import prove_profile

from .test_command import Bench, bench

PRIME, RUN, STOP = (COMMAND, 6), (COMMAND, 7), (COMMAND, 0)
FORWARD = 'name = "Run", words = [1], states = ["ready", "running"] }'
READY = '  { id = "ready", name = "Ready", kind = "ready", mask = 0x0001, value = 0x0001 },\n'
SEQUENCE = (
    (
        READY,
        '  { id = "primed", name = "Primed", kind = "stopped", mask = 0x0008, value = 0x0008 },\n'
        + READY,
    ),
    (
        "interlocks = [",
        """transitions = [
  { source = "ready", target = "primed", command = 6 },
  { source = "primed", target = "running", command = 7 },
  { source = "primed", target = "ready", command = 0 },
  { source = "running", target = "ready", command = 0 },
]
interlocks = [""",
    ),
)
WAY = (
    '[[parameters]]\ncode = "STAT"',
    '[[references]]\nparameter = "REF"\nkind = "frequency"\n\n[[parameters]]\ncode = "STAT"',
)


def forward(waits: str) -> tuple[str, str]:
    """The change that makes a run command of two words with these waits."""
    return FORWARD, FORWARD.replace("words = [1]", f"words = [6, 7], waits = [{waits}]")


@asynccontextmanager
async def primed(waits: str) -> AsyncIterator[Bench]:
    installed_mixer(HERTZ, "", *SEQUENCE, forward(waits))
    async with bench(MIXER) as made:
        yield made


def commands(made: Bench) -> list[tuple[int, int]]:
    return [write for write in made.writes() if write[0] == COMMAND]


async def test_sequence_waits_for_the_state_before_its_next_word() -> None:
    async with primed('{ states = ["primed"], ms = 1000 }') as made:
        outcome = await outcome_of(made.commander, lambda: made.commander.run("forward", "20Hz"))
        assert outcome is not None
        assert outcome.text == "Run: Running"
        assert commands(made) == [PRIME, RUN]


async def test_state_that_is_not_reached_ends_the_sequence_with_a_stop() -> None:
    async with primed('{ states = ["primed"], ms = 300 }') as made:
        made.drive.set("STAT", 1)
        made.commander.run("forward", "20Hz")
        text = await made.done(OutcomeKind.REFUSED)
        assert text == (
            "Run ended after word 1 of 2. The next step failed: The drive did not reach Primed in"
            " 0.3 s; it is in Ready. The drive was sent its stop (Stop). Check that the motor has"
            " stopped."
        )
        assert commands(made) == [PRIME, STOP]


async def test_stop_in_a_wait_is_sent_at_once_and_ends_the_sequence() -> None:
    async with primed("{ ms = 5000 }") as made:
        made.commander.run("forward", "20Hz")
        await made.until(lambda: commands(made) == [PRIME])
        await made.until(lambda: made.commander.outcome is not None)
        assert made.commander.outcome is not None
        assert made.commander.outcome.kind is OutcomeKind.WORKING
        assert made.commander.outcome.text == "Run: waiting 5 s"
        begun = made.clock.monotonic()
        made.stopper.stop([made.session])
        await made.until(lambda: STOP in commands(made))
        assert made.clock.monotonic() - begun < 1.0
        made.clock.advance(6.0)
        await asyncio.sleep(0.1)
        assert commands(made) == [PRIME, STOP]


async def test_disarming_in_a_wait_ends_the_sequence_with_a_stop() -> None:
    async with primed("{ ms = 300 }") as made:
        made.commander.run("forward", "20Hz")
        await made.until(lambda: commands(made) == [PRIME])
        made.session.arming.disarm("Disarmed by a key.")
        text = await made.done(OutcomeKind.REFUSED)
        assert "Disarmed by a key. The drive was sent its stop (Stop)." in text
        assert commands(made) == [PRIME, STOP]


@pytest.mark.parametrize(
    ("lost", "sent", "text"),
    [
        ({6}, [PRIME, STOP], "Run ended after word 1 of 2."),
        ({7}, [PRIME, RUN, STOP], "Run ended after word 1 of 2."),
        ({7, 0}, [PRIME, RUN, *[STOP] * 5], "Its stop failed: "),
    ],
)
async def test_lost_reply_in_a_sequence_ends_it_with_a_stop(
    monkeypatch: pytest.MonkeyPatch, lost: set[int], sent: list[tuple[int, int]], text: str
) -> None:
    async with primed("{}") as made:
        write = made.line.write

        async def losing(device: int, address: int, values: Sequence[int], **how: Any) -> Any:
            reply = await write(device, address, values, **how)
            if address == COMMAND and values[0] in lost:
                raise NoAnswer(device, 6, address)
            return reply

        monkeypatch.setattr(made.line, "write", losing)
        made.commander.run("forward", "20Hz")
        assert text in await made.done(OutcomeKind.REFUSED)
        assert commands(made) == sent
        assert made.commander.outcome is not None
        assert isinstance(made.commander.outcome.error, HalfSent)


@pytest.mark.parametrize("runs", [True, False])
async def test_motor_is_followed_to_its_standstill_after_half_of_a_command(runs: bool) -> None:
    async with primed('{ states = ["primed"], ms = 300 }') as made:
        fleet = Fleet(made.line, made.console.journal, clock=made.clock)
        fleet.take(made.session)
        made.drive.set("STAT", 2 if runs else 1)
        made.drive.set("FREQ", 200 if runs else 0)
        made.commander.run("forward", "20Hz")
        assert "ended after word 1 of 2" in await made.done(OutcomeKind.REFUSED)

        def is_over() -> bool:
            report = fleet.stopper.reports.get(1)
            return report is not None and report.phase in OVER

        await made.let_go_until(is_over)
        report, texts = fleet.stopper.reports[1], [event.text for event in fleet.events.events]
        assert not made.session.arming.armed
        assert "ended after word 1 of 2" in texts[0]
        if runs:
            assert report.text.startswith("NOT STOPPED: it answers and runs on")
            assert texts[1:] == [report.text]
        else:
            assert report.phase is Phase.STOPPED
            assert texts[1:] == [], "the reason stays the newest message"


@pytest.mark.parametrize(
    ("order", "sent"), [("take-control", [(COMMAND, 8), STOP]), ("hand-back", [(COMMAND, 8)])]
)
async def test_half_of_taking_control_is_stopped_and_half_of_giving_it_back_is_not(
    order: OrderId, sent: list[tuple[int, int]]
) -> None:
    """With half of the control, an old run command in the word of the line may take effect."""
    changed = (
        f'id = "{order}", name = "Control", words = [8, 16], states = ["ready"], waits = ['
        '{ states = ["primed"], ms = 300 }] },\n  { id = "forward", '
    )
    installed_mixer(HERTZ, "", *SEQUENCE, forward("{}"), ('id = "forward", ', changed))
    async with bench(MIXER) as made:
        fleet = Fleet(made.line, made.console.journal, clock=made.clock)
        fleet.take(made.session)
        made.drive.set("STAT", 1)
        made.commander.order(order)
        assert "Control ended after word 1 of 2" in await made.done(OutcomeKind.REFUSED)
        assert list(dict.fromkeys(commands(made))) == sent
        if STOP in sent:
            await made.let_go_until(lambda: bool(fleet.stopper.reports))
        assert bool(fleet.stopper.reports) is (STOP in sent)


@pytest.mark.parametrize("waits", ['{ states = ["primed"] }', "{ ms = 200 }", "{}"])
def test_profile_with_a_sequence_proves_itself(waits: str) -> None:
    profile = installed_mixer(HERTZ, "", *SEQUENCE, forward(waits), WAY)
    assert {step.title: step.fault for step in prove_profile(profile) if step.fault} == {}


def test_proof_fails_if_the_drive_never_shows_the_state_of_a_wait() -> None:
    waits = '{ states = ["fault"], ms = 200 }'
    profile = installed_mixer(HERTZ, "", *SEQUENCE, forward(waits), WAY)
    faults = {step.title: step.fault for step in prove_profile(profile) if step.fault}
    text = "the drive does not show fault before the next word, but primed"
    assert faults["forward (Run) leads to its state"] == text


def test_simulated_drive_ignores_a_word_that_comes_before_its_wait_is_over() -> None:
    changes = [SEQUENCE[0], forward("{ ms = 300 }"), WAY]
    profile = installed_mixer(HERTZ, "", *changes)
    for pause, runs in ((0.1, False), (0.4, True)):
        made = ProofBench(profile, profile.data.charts[0])
        made.write(profile["REF"], 200)
        made.write(profile["CTRL"], 6)
        made.wait(pause)
        made.write(profile["CTRL"], 7)
        made.wait(1.0)
        assert (made.hz > 1) is runs


MISTAKES = {
    "{ ms = 3600000 }": "must be <= 5000, not 3600000; allowed is 0 to 5000",
    '{ states = ["primed"], ms = 3600000 }': "must be <= 5000, not 3600000; allowed is 0 to 5000",
    "{ ms = -1 }": "must be >= 0, not -1",
    "{ ms = 1 }, { ms = 1 }": "it has 2 waits and 2 words. Waits are between words.",
    '{ states = ["hot"] }': "there is no state 'hot' to wait for; there are: fault, running,",
    "{ seconds = 1 }": "`seconds` is not a field of this table",
}


@pytest.mark.parametrize(("waits", "text"), MISTAKES.items())
def test_wait_that_is_wrong_is_refused_at_its_line(tmp_path: Path, waits: str, text: str) -> None:
    assert_refused(tmp_path, [*SEQUENCE, forward(waits)], text, 'id = "forward"')


def test_sequence_that_is_too_long_or_that_has_no_use_for_waits_is_refused(
    tmp_path: Path,
) -> None:
    long = FORWARD.replace("words = [1]", "words = [4, 5, 6, 7], waits = [{}, {}, {}]")
    long = long.replace("{}", "{ ms = 4000 }")
    text = "order forward: its waits take 12 s. Allowed are 10 s for one command."
    assert_refused(tmp_path, [*SEQUENCE, (FORWARD, long)], text, 'id = "forward"')
    walk = ('command = "CTRL"', 'command = "CTRL"\nruns_in = "running"')
    text = "order forward: its start follows the transitions and waits for each state."
    assert_refused(tmp_path, [*SEQUENCE, walk, forward("{ ms = 50 }")], text, 'id = "forward"')
    stop = ("words = [0] }", "words = [6, 0], waits = [{ ms = 50 }] }")
    text = "order stop: a stop never waits. Delete its waits."
    assert_refused(tmp_path, [*SEQUENCE, stop], text, 'id = "stop"')


def assert_refused(folder: Path, changes: Sequence[tuple[str, str]], text: str, place: str) -> None:
    """Assert that the check reports a text at the line of a place."""
    profile = mixer_text(HERTZ)
    for before, after in changes:
        assert before in profile, before
        profile = profile.replace(before, after)
    path = folder / "mixer.toml"
    path.write_text(profile, "utf-8")
    _, faults = examined(path, library.packaged_folder())
    line = profile[: profile.index(place)].count("\n") + 1
    assert [fault.line for fault in faults if text in fault.text] == [line], faults
