"""Defects of the diagnosis of a silent drive: a wrong cause, or a disturbed drive."""

from __future__ import annotations

from .defect import Defect

LADDER = "tests/session/test_diagnosis.py"
COMMAND = "tests/cli/test_why.py"
PORTS = "tests/bus/test_port_errors.py"
MEASURED = "tests/session/test_examining.py"

DEFECTS = (
    Defect(
        "silent-drive-said-to-be-well",
        "tui/session/diagnosis/diagnosis.py",
        "return bool(heard.requested) and heard.nothing and not heard.echoed",
        "return bool(heard.requested) and heard.nothing and bool(sight.neighbors)",
        "A script takes a line without any answer for a good one.",
        (f"{LADDER}::test_silent_drive_is_never_reported_as_healthy",),
    ),
    Defect(
        "echo-taken-for-an-answer",
        "tui/session/diagnosis/reply_evidence.py",
        "        if not tcp and data == request:\n",
        "        if not tcp and data == asked:\n",
        "An adapter that repeats every frame is taken for the drive.",
        (f"{LADDER}::test_echo_without_a_reply_is_the_cause",),
    ),
    Defect(
        "other-speed-told-the-wrong-way-round",
        "tui/session/diagnosis/next_steps.py",
        "wanted = sight.link.baud * due / came",
        "wanted = sight.link.baud * came / due",
        "The advice leads to a baud at which the drive is received even less.",
        (f"{LADDER}::test_bytes_at_another_baud_show_which",),
    ),
    Defect(
        "families-own-exception-taken-for-a-gateways",
        "tui/session/diagnosis/diagnosis.py",
        "if code in codes]",
        "if code not in codes]",
        "The drive is suspected although the gateway cannot reach it.",
        (f"{LADDER}::test_gateway_exception_is_the_cause",),
    ),
    Defect(
        "latency-told-unmeasured",
        "tui/session/diagnosis/diagnosis.py",
        "return not sight.heard.damaged and late * 1000 >= held * SEEN_OF_IT",
        "return not sight.heard.damaged",
        "An adapter that delays nothing is blamed.",
        (f"{LADDER}::test_latency_is_reported_if_set_and_measured",),
    ),
    Defect(
        "old-counts-taken-for-new",
        "tui/bus/transport/port_errors.py",
        "grown = [now - then for now, then in zip(self, before, strict=True)]",
        "grown = [now + 0 * then for now, then in zip(self, before, strict=True)]",
        "Last week's counts of the port are taken for a wrong baud today.",
        (f"{PORTS}::test_added_request_is_counted_if_a_reply_fails",),
    ),
    Defect(
        "asked-at-a-stops-priority",
        "tui/session/diagnosis/asking.py",
        "device, address, 1, priority=Priority.OPERATOR_READ, function=function",
        "device, address, 1, priority=Priority.FEED, function=function",
        "A diagnosis takes priority over the commands of an operator.",
        (f"{LADDER}::test_diagnosis_uses_operator_priority",),
    ),
    Defect(
        "why-ends-well-for-a-script",
        "tui/cli/commands/why.py",
        "    if not found.well:\n        raise click.exceptions.Exit(LINE_TROUBLE)\n",
        "",
        "A script continues with a drive that does not answer.",
        (f"{COMMAND}::test_missing_port_is_the_cause",),
    ),
    Defect(
        "another-speed-for-the-same-one",
        "tui/session/diagnosis/next_steps.py",
        "if not came or not due or same_speed(sight) or not isinstance(sight.link, SerialLink):",
        "if not came or not due or not isinstance(sight.link, SerialLink):",
        "The advice says that the speed is right, and to open the line at another one.",
        ("tests/session/test_diagnosis.py::test_garbage_at_the_same_baud_suggests_another_format",),
    ),
    Defect(
        "wires-of-who-answers",
        "tui/session/diagnosis/next_steps.py",
        'break answers too."\n    yield from wiring_hints(sight, answers=True)',
        'break answers too."\n    yield from wiring_hints(sight)',
        "A person swaps the wires of a drive that answers.",
        ("tests/session/test_diagnosis.py::test_answering_drive_has_correct_wires",),
    ),
    Defect(
        "copies-taken-for-a-second-drive",
        "tui/session/diagnosis/measure.py",
        "        if paused.second >= TURNS:",
        "        if self.second:",
        "A person looks for a second drive although an adapter sends each frame twice.",
        (f"{MEASURED}::test_copy_during_the_next_request_is_not_a_second_drive",),
    ),
    Defect(
        "late-replies-taken-for-one-behind",
        "tui/session/diagnosis/measure.py",
        "prompt = due and frame.time - now.began < PROMPT",
        "prompt = due",
        "A slow drive is reported as showing values of other registers.",
        (f"{MEASURED}::test_reply_one_behind_is_immediate_unlike_a_late_one",),
    ),
    Defect(
        "collisions-taken-for-one-behind",
        "tui/session/diagnosis/measure.py",
        "if exchange.older and "
        '(exchange.replies or exchange.damaged or exchange.older == "second"):',
        "if exchange.older and exchange.replies:",
        "Two drives at one address are reported as a converter that is behind.",
        (f"{MEASURED}::test_older_reply_is_classified_by_the_other_replies",),
    ),
    Defect(
        "gateway-refusals-taken-for-replies",
        "tui/session/diagnosis/measure.py",
        "and body[-1] in unreached:",
        "and body[-1] in ():",
        "A gateway that sometimes misses the drive is reported as good.",
        (f"{MEASURED}::test_gateway_exceptions_are_counted",),
    ),
    Defect(
        "lone-unit-of-a-gateway-that-passes-units-on",
        "tui/session/diagnosis/gateway_probe.py",
        "    if others - {device, ANY_UNIT}:\n        return None  # the gateway passes units on\n",
        "",
        "An unused address is reported as a gateway that answers only unit 255.",
        (f"{MEASURED}::test_answering_line_gets_no_second_connection",),
    ),
    Defect(
        "requests-beside-another-master",
        "tui/session/diagnosis/examining.py",
        "if others.has_frames or loose >= TRAFFIC:",
        "if False:",
        "A diagnosis disturbs the master that controls the line.",
        (f"{MEASURED}::test_nothing_is_sent_while_another_master_is_active",),
    ),
    Defect(
        "line-lost-in-a-silence-ends-the-proof",
        "tui/session/proof/prover.py",
        "                if clock.monotonic() >= limit:\n                    raise\n",
        "                raise\n",
        "Behind a gateway that closes idle connections, a timeout test has no result.",
        (
            "tests/session/test_prover.py::"
            "test_connection_closed_in_a_silence_is_read_after_it_returns",
        ),
    ),
)
