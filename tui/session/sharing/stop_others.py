"""Stops of drives that other programs on the line command, and that this program has not open."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Collection
from functools import partial

from tui.bus.api import ModbusLine
from tui.bus.line_events import StopDue

from ..carry_on import carried_on
from ..command.stop_report import not_stopped
from ..starts.starts import Starts
from .orphan_motors import started_by_absent

log = logging.getLogger(__name__)

TRIES, TRY_AGAIN = 5, 0.5
"""Attempts to reach the holder of the line, which may just be replaced; seconds between two."""

AddMessage = Callable[[str, str, int], object]
"""Adds a message: its kind, its text, and the drive."""


def request_stops_of_others(
    line: ModbusLine, own: Collection[int], by: str, tell: AddMessage
) -> tuple[int, ...]:
    """Stop the drives that other programs command, except `own`; return their addresses.

    Motors that were started by programs which have left the line are stopped too, but are not
    returned: their records must be read first. The holder of the line sends the stops, since it
    knows the words of each armed drive. For any thread; returns at once. Nothing is stopped on a
    read-only line.
    """
    facts = line.facts
    if line.read_only:
        return ()
    others = tuple(device for device in facts.commanders if device not in own)
    if others:
        facts.give_stop(others, by)
        for device in others:
            program = facts.commander(device)
            named = program.text if program is not None else "another program"
            tell("stop", f"Stop requested: {named} commands it.", device)
        _in_thread(partial(_request_stops, line, others, by, tell))
    if facts.departed:
        _in_thread(partial(_stop_of_absent, line, {*own, *others}, by, tell))
    return others


def _in_thread(work: Callable[[], object]) -> None:
    target = partial(carried_on, work)
    threading.Thread(target=target, name="stops by the holder", daemon=True).start()


def _stop_of_absent(line: ModbusLine, known: Collection[int], by: str, tell: AddMessage) -> None:
    """Stop the other motors that were started by programs which have left the line."""
    records = started_by_absent(line, Starts())
    devices = tuple(record.device for record in records if record.device not in known)
    if not devices:
        return
    line.facts.give_stop(devices, by)
    for device in devices:
        tell("stop", "Stop requested: the program that started it has left the line.", device)
    _request_stops(line, devices, by, tell)


def _request_stops(line: ModbusLine, devices: tuple[int, ...], by: str, tell: AddMessage) -> None:
    """Have the holder of the line stop devices; report each that it does not accept."""
    error = OSError("the line has no holder")
    for _ in range(TRIES):
        voice = line.facts.voice
        if voice is not None and not voice.holder:
            line.facts.events.emit(StopDue(devices, by))
            return
        try:
            if voice is not None:
                voice.stop_directly(devices)
                return
        except OSError as failure:
            log.warning("the holder of the line did not accept a stop: %s", failure)
            error = failure
        time.sleep(TRY_AGAIN)
    for device in devices:
        tell(
            "failed",
            not_stopped(f"the process that holds the line does not answer ({error})."),
            device,
        )
