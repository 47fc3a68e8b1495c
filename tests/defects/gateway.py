"""Defects of the line that programs of others reach by Modbus TCP."""

from __future__ import annotations

from .defect import Defect

GATEWAY = "tests/session/test_gateway.py"
WORDS = "tests/drive/test_foreign_write.py"

DEFECTS = (
    Defect(
        "foreign-commands-unasked",
        "tui/session/gateway/writes.py",
        "if commands and not self._rules.commands:",
        "if False:",
        "Any program that reaches the port starts motors.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-command-beside-a-panel",
        "tui/session/gateway/commanding.py",
        "if why := self._line.facts.claim(device):",
        'if why := "":',
        "A client commands a drive, and no panel shows it.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-stop-waits-for-leave",
        "tui/session/gateway/writes.py",
        "if len(stops) == len(words):",
        "if False:",
        "The stop of a controller is refused where it may not command.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-stop-unheard",
        "tui/session/gateway/commanding.py",
        'self._line.facts.give_stop([device], f"Modbus TCP client {client}")',
        "pass",
        "A controller's stop leaves the work of a panel going.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-stop-lost-among-others",
        "tui/session/gateway/writes.py",
        "await self._send_alone(one)",
        "pass",
        "A stop that is written with its reference is refused with it.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-run-word-repeated",
        "tui/session/gateway/commanding.py",
        "if by is not None:",
        "if False:",
        "A controller that repeats its word starts the motor after a person's stop.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-command-outlives-a-stop",
        "tui/session/gateway/writes.py",
        'return "" if now == self._stamp else',
        'return "" if True else',
        "A command that was looked at during a stop goes out after it.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-start-unrecorded",
        "tui/session/gateway/started.py",
        "await asyncio.to_thread(self._keeper.begin, session, order)",
        "pass",
        "Nobody stops the motor of a controller whose gateway was killed.",
        (GATEWAY,),
    ),
    Defect(
        "foreign-motor-left-at-the-end",
        "tui/session/gateway/started.py",
        "        if left:",
        "        if False:",
        "A service that is restarted leaves motors that nobody commands.",
        (GATEWAY,),
    ),
    Defect(
        "stop-word-of-another-chart",
        "tui/drive/foreign_write.py",
        "return bool(charts) and all(",
        "return bool(charts) and any(",
        "A word passes as a stop that runs the motor in the I/O profile.",
        (WORDS,),
    ),
    Defect(
        "stop-word-of-another-state",
        "tui/drive/foreign_write.py",
        "if status is None or state_of(chart, status).id not in order.states:",
        "if False:",
        "A halt word passes as a stop where the drive takes it for something else.",
        (WORDS,),
    ),
    Defect(
        "control-is-a-setting",
        "tui/drive/foreign_write.py",
        "if any(is_order(profile, one) or one.code in _ordered(profile) for one in found):",
        "if any(is_order(profile, one) for one in found):",
        "A client takes the control of a Powerdrive by writing a setting.",
        (WORDS,),
    ),
    Defect(
        "all-means-everything",
        "tui/drive/foreign_write.py",
        "if one.code in _named_only(profile) or not is_verified(one):",
        "if False:",
        "A client that may write settings decides who commands the drive.",
        (WORDS,),
    ),
    Defect(
        "foreign-profile-contradicted",
        "tui/session/gateway/drives.py",
        "if session.contradiction:",
        "if False:",
        "Words are told apart by the profile of another family.",
        (GATEWAY,),
    ),
    Defect(
        "absent-drive-takes-the-line",
        "tui/session/gateway/gateway.py",
        "known = state.heard is not None or state.next_try is not None",
        "known = state.heard is not None",
        "A client that asks for a drive which is not there slows all others down.",
        (GATEWAY,),
    ),
    Defect(
        "half-a-value-written",
        "tui/bus/gateway/pdu.py",
        "if size != 2 * count or len(data) != size:",
        "if len(data) < 2 * count:",
        "A damaged request is half understood and written.",
        ("tests/bus/test_gateway.py",),
    ),
)
