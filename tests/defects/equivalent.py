"""Random defects that change nothing a person or a program could notice, each with why."""

from __future__ import annotations

EQUIVALENT: dict[str, str] = {
    "tui/bus/schedule/step_proof.py:StepProof.sent: condition: job.priority is Priority.STOP and"
    " job.request.changes -> ((job.priority is Priority.STOP) or (job.request.changes))": (
        "Anything but a write of a stop waits until replies are trusted, so it is not sent here."
    ),
    "tui/bus/schedule/connection.py:Connection._serve: return: return -> pass": (
        "The call before it never returns: it serves until the line is lost, which it raises."
    ),
    "tui/session/drive.py:DriveSession.request_full_read: constant: 1 -> 2": (
        "Monitors notice that the count differs, not by how much."
    ),
    "tui/session/drive.py:DriveSession.request_full_read: constant: 1 -> 10": (
        "Monitors notice that the count differs, not by how much."
    ),
    "tui/session/command/stop.py:Stopper.stop: constant: 0.0 -> 1.0": (
        "It is the time of a stop of no drives, which has no report."
    ),
    "tui/bus/schedule/queue.py:LineShares.come: return: return -> pass": (
        "Kinds without a minimum share are counted no time, so that each program has had none."
    ),
    "tui/drive/read_plan.py:run_length: constant: 0 -> 1": (
        "A run of one parameter has returned by then, and all of a run have the same function."
    ),
    "tui/drive/read_plan.py:_cheapest: boundary: last - ordered[start].address >= longest ->"
    " (last - ordered[start].address > longest)": (
        "The read that is looked at in addition is too long, and `run_length` refuses it."
    ),
    "tui/drive/read_plan.py:_cheapest: constant: 0 -> 1": (
        "The first entry is of no parameters: where its last run begins is not read."
    ),
    "tui/bus/rtu/exchange.py:RtuExchange._is_too_short: condition: not self._exceptions or refusal"
    " not in self.buffer -> ((not self._exceptions) and (refusal not in self.buffer))": (
        "It saves time only: a search of too few bytes finds no reply."
    ),
    "tui/bus/rtu/exchange.py:noted: condition: result.pdu -> (not (result.pdu))": (
        "It saves time only: a whole reply that is alone has the same remark as one piece of many."
    ),
    "tui/bus/rtu/exchange.py:noted: constant: 3 -> 30": (
        "It saves time only: a whole reply that is alone has the same remark as one piece of many."
    ),
    "tui/bus/rtu/exchange.py:noted: constant: 3 -> 4": (
        "It saves time only: a whole reply that is alone has the same remark as one piece of many."
    ),
    "tui/bus/tally.py:MinuteWindow.__init__: constant: 0 -> 1": (
        "It is the time of a sum of no buckets, which no buckets are compared with."
    ),
    "tui/bus/schedule/step_proof.py:StepProof.not_before: constant: 0 -> 1": (
        "Before the first request for a proof, both are fewer than the most."
    ),
    "tui/bus/shared_state.py:SharedState.give_stop: constant: 0.0 -> 1.0": (
        "The count of the stop, just before, has given each device its time."
    ),
    "tui/bus/schedule/engine.py:Engine.spawn: raise: raise LineClosed -> pass": (
        "Without a loop, `_enter` raises the same error."
    ),
    "tui/session/carry_on.py:carried_on: return: return -> pass": ("It is the last statement."),
}
"""By the identity of the defect, as `python -m tests.mutants --random` prints it."""
