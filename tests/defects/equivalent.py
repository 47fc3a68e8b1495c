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
    "tui/drive/read_plan.py:_cheapest: boundary: last - first.address >= longest -> (last -"
    " first.address > longest)": (
        "The read that is looked at in addition is too long, and `_is_allowed` refuses it."
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
    "tui/bus/schedule/outcomes.py:Outcomes._report_write: constant: 0.0 -> 1.0": (
        "The time counts from the start of the computer: no write is in its first second."
    ),
    'tui/bus/rtu/master.py:RtuMaster._send: text: "The line was lost." -> ""': (
        "The call before it has set the failure, which is raised."
    ),
    "tui/bus/schedule/probes.py:Probes.sent: constant: 0 -> 1": (
        "All devices of a gateway share one entry, whatever its key is."
    ),
    "tui/drive/read_plan.py:plan_reads: argument: ReadPlan((), 0.0) -> ReadPlan(0.0, ())": (
        "There is always a plan: that without any block."
    ),
    "tui/drive/read_plan.py:plan_reads: constant: 0.0 -> 1.0": (
        "There is always a plan: that without any block."
    ),
    "tui/drive/read_plan.py:plan_reads: boundary: (seconds, len(requests)) < (best.seconds,"
    " len(best.requests)) -> ((seconds, len(requests)) <= (best.seconds, len(best.requests)))": (
        "Of two plans with equally many reads in the same time, neither is better."
    ),
    "tui/drive/read_plan.py:_cheapest: constant: 0.0 -> 1.0": (
        "It is added to the time of each choice alike."
    ),
    "tui/drive/read_plan.py:_cheapest: constant: 1 -> 2 #3": (
        "Reads that are too long are looked at in addition, and `_is_allowed` refuses them."
    ),
    "tui/drive/read_plan.py:_cheapest: boundary: start < end - 1 -> (start <= end - 1)": (
        "A run of one parameter is no words long, which is never the most."
    ),
    "tui/drive/read_plan.py:_cheapest: constant: 1 -> 10 #4": (
        "Reads that are too long are looked at in addition, and `_is_allowed` refuses them."
    ),
    "tui/drive/read_plan.py:_cheapest: constant: 1 -> 2 #4": (
        "Reads that are too long are looked at in addition, and `_is_allowed` refuses them."
    ),
    "tui/drive/words.py:to_words: constant: 0 -> 1": ("The value replaces all bits of its word."),
    "tui/drive/values.py:engineering: boundary: -int(scale.as_tuple().exponent) > decimals ->"
    " (-int(scale.as_tuple().exponent) >= decimals)": (
        "A number with so many decimals stays as it is."
    ),
    "tui/drive/values.py:engineering: constant: 1 -> 10": "Only the exponent of it counts.",
    "tui/drive/values.py:engineering: constant: 1 -> 2": "Only the exponent of it counts.",
    'tui/drive/values.py:engineering: text: "0" -> "" #2': "To add 0 changes nothing.",
    "tui/session/read/reader.py:Reader._take: argument: codes.difference(image.refused, found) ->"
    " codes.difference(found, image.refused)": ("Both are left out, in whichever order."),
    "tui/session/work.py:WorkQueue.stop: call: object() -> None": (
        "No worker has None as its identity."
    ),
    "tui/bus/stop_counts.py:StopCounts.note: argument: zip(devices, counts, strict=False) ->"
    " zip(devices, counts)": ("It is the default."),
    "tui/bus/share/polls.py:PollsServed._read: constant: 0.0 -> 1.0": (
        "It is long ago in any case: a plan that was never read may reuse any reply of its age."
    ),
    "tui/session/monitor/trend.py:Trend.join: constant: 0.0 -> 1.0": (
        "It is the last time of no points, which none is compared with."
    ),
    "tui/session/monitor/line_watch.py:LineWatch._last_seen: constant: 0.0 -> 1.0": (
        "The time counts from the start of the computer: no cycle ends in its first second."
    ),
    'tui/drive/profile/heads.py:_read_tables: call: section(text, "functions") -> None': (
        "It saves time only: the whole file is read then, and has the same tables."
    ),
    "tui/bus/schedule/alive_reads.py:AliveReads.__init__: constant: 0.0 -> 1.0": (
        "The first look has seen nothing before, and so it looks whatever is due."
    ),
    "tui/bus/schedule/pace.py:Pace.claim: argument: greatest(self.own, self.others) ->"
    " greatest(self.others, self.own)": ("The greatest wish is the same in either order."),
    "tui/bus/schedule/queue.py:SentStops.__init__: constant: False -> True": (
        "A stop yields only if the same one was counted, and a count sets it."
    ),
    "tui/screens/trend/contents.py:mark_places: constant: 0 -> 1": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/contents.py:mark_places: constant: 1 -> 10": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/contents.py:mark_places: constant: 1 -> 2": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:tick_columns: constant: 0 -> 1": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:tick_columns: constant: 1 -> 10": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:tick_columns: constant: 1 -> 2": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:trend_axis: constant: 0 -> 1": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:trend_axis: constant: 1 -> 10": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:trend_axis: constant: 1 -> 2": (
        "Only columns are taken from this plot, and its scale is for rows."
    ),
    "tui/screens/trend/axis.py:tick_columns: constant: 1 -> 10 #2": (
        "A tick after the page has no column."
    ),
    "tui/screens/trend/axis.py:tick_columns: constant: 1 -> 2 #2": (
        "A tick after the page has no column."
    ),
    "tui/bus/transport/serial_posix.py:PosixSerial.__init__: argument:"
    " os.set_blocking(port.fileno(), False) -> os.set_blocking(False, port.fileno())": (
        "pyserial has opened the port without blocking."
    ),
    "tui/screens/monitor/assembly.py:motor_lines: constant: True -> False #2": (
        "Each value has a label."
    ),
    "tui/screens/monitor/assembly.py:motor_lines: argument: zip(values, labels, strict=True) ->"
    " zip(values, labels)": ("Each value has a label."),
    "tui/drive/settings/compare.py:_row: constant: True -> False": (
        "It is `strict` of a zip of two pairs."
    ),
    "tui/drive/teaching.py:_agrees: constant: 0 -> 1": (
        "A number of a display is digits with decimals: its exponent is never above 0."
    ),
}
"""By the identity of the defect, as `python -m tests.mutants --random` prints it."""
