"""A stop also cancels commands typed before it that start later."""

from __future__ import annotations

import math
import os
import time

import click
import pytest

from tui.bus.fake import FakeLine
from tui.cli.main import main
from tui.cli.shared.drive_commands import permit_of
from tui.cli.shared.errors import REFUSED_HERE, Failure
from tui.cli.shared.typed import ONE_COMMAND, note_typed, process_began, typed_at
from tui.drive.profile import library
from tui.session.drive import DriveSession


def session_of(line: FakeLine, device: int = 1) -> DriveSession:
    return DriveSession(line, device, library.load("atv71"))


def test_stop_refuses_input_typed_before_it_only() -> None:
    line = FakeLine({1: {}, 2: {}})
    with click.Context(main) as typed:
        note_typed(typed)
        line.facts.stops.note("other", (1,), (1,), "the stop key, panel (pid 7)")
        session = session_of(line)
        with pytest.raises(Failure, match=r"stopped after this .* \(the stop key, panel") as caught:
            permit_of(session)
        assert caught.value.status == REFUSED_HERE
        assert not session.arming.armed
        permit_of(session_of(line, 2)).check()
    with click.Context(main) as typed_again:
        note_typed(typed_again)
        permit_of(session).check()


def test_command_was_typed_when_its_process_began() -> None:
    with click.Context(main, obj=ONE_COMMAND) as context:
        note_typed(context)
        typed = typed_at(context)
    assert typed is not None
    assert math.isclose(typed, process_began(), abs_tol=0.1)
    assert typed < time.monotonic()


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="no /proc")
def test_process_start_time_is_that_of_the_system() -> None:
    assert time.monotonic() - 3600 * 24 < process_began() < time.monotonic() - 0.2
