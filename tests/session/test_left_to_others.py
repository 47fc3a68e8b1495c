"""Text about a motor that is left running on a line shared with other programs."""

from __future__ import annotations

import pytest

from tui.bus.fake import FakeLine
from tui.bus.program import Program
from tui.drive.profile import library
from tui.session.drive import DriveSession
from tui.session.sharing.handover import peer_effect_text
from tui.session.starts.keeper import StartKeeper

WATCH = Program("watch", "watch", 78)
PANEL = Program("panel", "panel", 77, "", "pts/9")
STOPPED = "The motor is stopped on its ramp within 10 s, unless"
RUNS_ON = "the motor runs."


def on_a_line(*others: Program, requested: bool = True) -> DriveSession:
    """A drive whose motor this program has started."""
    line = FakeLine({1: {}})
    line.facts.set_programs((line.facts.me, *others))
    line.pace.others = {1: 0.1} if requested else {2: 0.1}
    session = DriveSession(line, 1, library.load("atv71"))
    session.starts = StartKeeper("panel")
    session.starts.begin(session, "forward")
    session.starts.sent(session)
    return session


@pytest.mark.parametrize("on_purpose", [False, True])
def test_text_is_empty_without_other_programs(on_purpose: bool) -> None:
    assert peer_effect_text(on_a_line(), on_purpose=on_purpose) == ""


def test_other_programs_stop_a_motor_not_left_on_purpose() -> None:
    reported = peer_effect_text(on_a_line(WATCH, requested=False), on_purpose=False)
    alone = "The line is shared with watch (pid 78)."
    assert reported == f"{alone} {STOPPED} the line is opened here again."
    reported = peer_effect_text(on_a_line(PANEL), on_purpose=False)
    assert f"{STOPPED} it is taken over there, or the line" in reported
    reported = peer_effect_text(on_a_line(WATCH, PANEL), on_purpose=False)
    assert reported.startswith("The line is shared with other programs. ")


def test_motor_left_on_purpose_runs_while_it_is_polled() -> None:
    reported = peer_effect_text(on_a_line(WATCH), on_purpose=True)
    assert reported == f"As long as watch (pid 78) polls this drive, {RUNS_ON}"
    assert peer_effect_text(on_a_line(WATCH, requested=False), on_purpose=True) == ""


def test_closing_a_line_leaves_motors_running_if_chosen() -> None:
    session = on_a_line(WATCH, PANEL)
    assert session.starts is not None
    session.starts.leave(session)
    reported = peer_effect_text(session, on_purpose=False)
    assert reported == f"As long as other programs on the line poll this drive, {RUNS_ON}"


def test_motor_of_another_source_is_not_stopped_by_other_programs() -> None:
    session = on_a_line(WATCH)
    assert session.starts is not None
    session.starts.give_away(session)
    assert RUNS_ON in peer_effect_text(session, on_purpose=False)
