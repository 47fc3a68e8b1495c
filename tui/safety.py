"""Limits that safety depends on: how long things wait, and how old they may be.

Each has its unit and its reason; `tests/test_safety.py` names the tests on both sides of each.
"""

from typing import Final

# Arming and keys

ARMED_FOR: Final = 60.0
"""Seconds without a key after which a drive is disarmed: longer, and a person has walked away
from an armed drive."""
CLIENT_WRITE_ARMED_FOR: Final = 10.0
"""Seconds for which one write of a Modbus TCP client may wait for the line."""
ENTER_COUNTS_AFTER: Final = 0.3
"""Seconds after which Enter counts on the run line: an earlier one was typed before the line was
seen."""
ANSWER_COUNTS_AFTER: Final = 1.0
"""Seconds without a key after which a question that appeared on its own accepts an answer."""
BURST_GAP: Final = 0.05
"""Seconds between two reads of the terminal; keys that are closer belong to one burst."""
KEY_TOO_LATE: Final = 3.0
"""Seconds after which a key has only the effect of a key in a burst: the panel stood still, and
its user expects nothing from the key."""

# Commands that wait

COMMAND_TOO_LATE: Final = 2.0
"""Seconds after which a command of an attached program is not sent: its user no longer expects
it."""
GATEWAY_SUSPENDED_AFTER: Final = 2.0
"""Seconds without a turn of its loop after which the gateway drops the commands that came in the
meantime."""
CLIENT_MOTORS_STOP_WITHIN: Final = 10.0
"""Seconds that a gateway which ends waits for the standstill of its motors, to report others."""
REQUEST_ANSWERED_WITHIN: Final = 15.0
"""Seconds that a commander has to answer a request for its drive. Then no answer means no while
the motor runs, yes at standstill."""
STANDSTILL_SEEN_WITHIN: Final = 2.0
"""Seconds since the motor was seen at standstill, for that yes."""
START_PATIENCE: Final = 5.0
"""Seconds that a start waits for the disk to record it; a slow memory card takes two."""
STEP_TIME: Final = 2.0
"""Seconds that a drive has for one step of its state chart."""

# Programs on a line

LEASE_RENEWED_EVERY: Final = 1.0
"""Seconds between two messages that renew a lease: a lease must outlive a lost one."""
OWNER_BEAT_INTERVAL: Final = 0.2
"""Seconds between two heartbeats of the owner of a line."""
BEAT_INTERVAL: Final = 0.4
"""Seconds between two heartbeats of an attached program."""
BEAT_WITHIN: Final = 0.5
"""Seconds that the owner has to accept a heartbeat."""
SENDS_WITHIN: Final = 0.7
"""Seconds without a heartbeat of some program after which the owner sends only stops: it may
have been suspended, and others may have stopped drives since."""
BACK_WITHIN: Final = 2.0
"""Seconds that programs have to report after the owner was suspended."""
BACK_AT_LATEST: Final = 6.0
"""Seconds after which programs that have not reported count as ended in any case."""
LOOP_HANGS: Final = 3.0
"""Seconds without a turn of the line's loop after which its program counts as hung."""
SILENT_CLIENT: Final = 2.0
"""Seconds without a heartbeat after which the owner disconnects a program, and stops its motors."""
ALARM_AFTER: Final = 2.0
"""Seconds without a turn of its loop after which an alarm ends a keeper, so that another one can
serve its line."""
AWAKE: Final = 0.3
"""Seconds between two checks of the owner; after a longer pause this program was suspended
itself and must not judge."""
SILENT_OWNER: Final = 1.0
"""Seconds without a heartbeat after which an owner counts as frozen."""
TAKEN_IN_WITHIN: Final = 1.0
"""Seconds that a keeper has to answer a greeting."""
STOP_HEARD_WITHIN: Final = 1.0
"""Seconds that a keeper has to acknowledge a stop, before it is replaced."""
HEARD_WITHIN: Final = 3.0
"""Seconds that a keeper may send nothing, before it is replaced."""
FROZEN_IN_SENDING: Final = 0.2
"""Seconds from the last check of the line to the end of sending; after a longer pause the reply
may belong to another request."""
LINGERS: Final = 10.0
"""Seconds that a keeper waits for the next program, its port closed."""

# Stops

STOP_KEPT_FOR: Final = 600.0
"""Seconds for which a stop waits for a lost line, to be sent first once it is open again."""
JUST_SENT: Final = 3.0
"""Seconds for which an equal stop counts as a repeat of the one that was sent."""
MOST_UNACKNOWLEDGED: Final = 5
"""Times that a stop is sent without an acknowledgment, before the next counts as a repeat."""
STOP_DUE: Final = 10.0
"""Seconds for which a stop of a program that has ended is still carried out."""
STOPS_KEPT: Final = 600.0
"""Seconds for which the next owner of a line is informed when a device was stopped."""
TURN_WITHIN: Final = 0.3
"""Seconds for which a stop after an internal error waits for the exchange in flight."""
STOP_TRIES: Final = 5
"""Times that a stop is sent until the drive answers."""
TAKES_EFFECT: Final = 1.5
"""Seconds that a drive has to show that it obeys a stop. Then NOT STOPPED is shown."""
STOP_FOLLOWED_FOR: Final = 60.0
"""Seconds for which a stop is followed to standstill; a ramp may take that long."""
HANGS_AFTER: Final = 0.25
"""Seconds in which a stop begins; then it is sent around the loop of this program, which hangs."""
STOP_REPEATED_EVERY: Final = 1.0
"""Seconds between two attempts to stop drives around a loop that hangs."""
STOP_DISK_WITHIN: Final = 1.0
"""Seconds that a stop waits for the disk to lock the line; then it is sent without a lock."""
SEEN_RUNNING: Final = 10.0
"""Seconds for which a motor that was seen running counts as running. Drives are read every 3 to
5 s."""

# Motors of programs that ended

TAKEN_OVER_WITHIN: Final = 2.0
"""Seconds in which a person may take over a motor, if the timeout of its drive is not known."""
LONGEST_GRACE: Final = 10.0
"""Seconds in which a person may take over a motor at most, whatever the timeout of its drive."""
LINE_BACK_WITHIN: Final = 600.0
"""Seconds for which a motor on a lost line is still stopped once the line is back."""
GRACE_SHARE: Final = 0.25
"""Share of its timeout for which a drive is polled after the last heartbeat of its commander."""

# Age of values

STALE_CYCLES: Final = 3
"""Cycles after which a value is shown as stale."""
STALE_LEAST: Final = 1.5
"""Seconds for which a value is not stale, however short the cycle."""
SHARED_AGE: Final = 0.5
"""Share of a cycle: the age up to which a poll uses a value that another program has read."""
SOURCE_AGE: Final = 5.0
"""Seconds for which a poll uses a word that determines how others are read. An operator's read
reads it again."""
STATE_FRESH: Final = 1.0
"""Seconds for which a state counts as current before a command; an older one is read again."""
CHART_AGE: Final = 2.0
"""Seconds for which a write of a Modbus TCP client uses the word that chooses the state chart."""
JUST_READ: Final = 2.0
"""Seconds for which a word counts as just read before a write of a Modbus TCP client."""
JUST_SEEN: Final = 2.0
"""Seconds for which a state counts as current before the gateway stops keeping a drive alive."""
LOOK_IS_OLD: Final = 10.0
"""Seconds after which the state of a drive without a monitor is shown as stale."""
WAS_OFF: Final = 3.0
"""Seconds without a reply after which a drive that answers again was switched off: what was read
of it is read again."""
ASLEEP: Final = 0.8
"""Seconds without a reply in which a drive may have been restarted: its block is compared again."""

# Replies and communication timeouts

READS_PER_TIMEOUT: Final = 4.0
"""Keep-alive reads in one communication timeout of a drive, so that one lost reply trips
nothing."""
LOOKS_PER_TIMEOUT: Final = 2.0
"""Times in each timeout of a drive that the gateway reads if its motor is still at rest: only
then it keeps the drive alive."""
MARGIN: Final = 4
"""Times the worst recent turnaround: the timeout of a reply."""
LATE_MARGIN: Final = 2.0
"""Times the worst lateness seen: the time for which a late reply is awaited."""
LATE_REPLY: Final = 2.0
"""Times the timeout that a person has set: the time by which a reply may be late."""
LONGEST_WAIT: Final = 10.0
"""Seconds for which a late reply is awaited at most."""
QUIET_SHARE: Final = 0.3
"""Share of the timeout for which the line keeps quiet for one late device, at most."""
MISSES: Final = 3
"""Replies in a row that a known device misses before its polls pause."""
WARNED_AT_SHARE: Final = 0.5
"""Share of its communication timeout after which a drive without a reply is reported."""
