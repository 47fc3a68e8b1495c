"""Defects of the identity of a drive, of its stop before identification, and of its timeout."""

from __future__ import annotations

from .defect import Defect

CONTRADICTION = "tests/session/test_contradiction.py"
FIRST = "tests/drive/test_first_stop.py"
TIMEOUT = "tests/session/test_timeout.py"
IDENTITY = "tests/cli/test_identity.py"
LEFT = "tests/cli/test_pending_timeouts.py"

BYTES = "tests/session/test_byte_order.py"

DEFECTS = (
    Defect(
        "family-guessed-after-a-sick-minute",
        "tui/session/connect/identifying.py",
        "or (healthy and _is_sick(line, device)):",
        "or (healthy and _is_sick(line, device) and False):",
        "An ATV71 on a line that has just lost frames is shown as a Leroy-Somer drive.",
        (
            "tests/session/test_find_drive.py"
            "::test_silence_after_a_minute_with_errors_infers_no_family",
        ),
    ),
    Defect(
        "swapped-bytes-armed",
        "tui/session/arming.py",
        "        if why := self.trouble():\n",
        "        if (why := self.trouble()) and False:\n",
        "A motor is commanded by words whose bytes arrive swapped.",
        (f"{BYTES}::test_swapped_bytes_refuse_arming_and_disarm",),
    ),
    Defect(
        "swapped-bytes-kept",
        "tui/session/drive.py",
        "        if (error := self.byte_order.error) is not None:\n",
        "        if (error := self.byte_order.error) is not None and False:\n",
        "HSP 6246.5 Hz is shown as a good value.",
        (f"{BYTES}::test_monitor_of_swapped_bytes_shows_no_good_value",),
    ),
    Defect(
        "one-word-means-swapped-bytes",
        "tui/session/byte_order.py",
        "LEAST_REGISTERS = 3\n",
        "LEAST_REGISTERS = 1\n",
        "One value out of range takes a healthy drive out of use.",
        (f"{BYTES}::test_regular_reads_detect_bytes_that_become_swapped",),
    ),
    Defect(
        "line-that-was-lost-not-checked-again",
        "tui/session/byte_order.py",
        "        self._was_away = self._tested\n",
        "        self._was_away = False\n",
        "Through another gateway a motor is commanded by swapped words.",
        (f"{BYTES}::test_recovered_line_is_checked_again_before_a_command",),
    ),
    Defect(
        "stop-by-a-value-of-no-chart",
        "tui/drive/orders.py",
        "return found if found is None or found.when is None or found.when.holds(raws) else None",
        "return found",
        "The stop word of Drivecom runs a motor in the I/O profile.",
        (f"{BYTES}::test_stop_with_swapped_bytes_never_uses_the_word_of_another_chart",),
    ),
    Defect(
        "contradicted-drive-armed",
        "tui/session/arming.py",
        "        if self.barred:\n            return self.barred\n",
        "",
        "A drive is commanded with the words of another family.",
        (CONTRADICTION,),
    ),
    Defect(
        "cut-short-reference-contradicts",
        "tui/session/connect/contradiction.py",
        "return reported.startswith(stem) or stem.startswith(reported)",
        "return False",
        "A drive of a type similar to its profile's is refused.",
        (CONTRADICTION,),
    ),
    Defect(
        "contradicted-drive-stopped-by-the-wrong-family",
        "tui/session/command/stop.py",
        "if not session.contradiction or own is None:",
        "if True or own is None:",
        "The stop key runs a motor whose drive was identified as another family.",
        (f"{CONTRADICTION}::test_contradicting_drive_is_stopped_by_its_own_family",),
    ),
    Defect(
        "profile-believed-by-the-command-line",
        "tui/cli/shared/options.py",
        "    if session.contradiction:\n",
        "    if False:\n",
        "A setting of one family is written to a drive of another.",
        (f"{IDENTITY}::test_write_to_a_drive_of_another_family_exits_with_5",),
    ),
    Defect(
        "first-word-of-one-family-only",
        "tui/drive/first_stop.py",
        "_stopped_by(other, place.address, values, raws) for other in may_be",
        "_stopped_by(other, place.address, values, raws) for other in may_be[:1]",
        "The stop word of one family runs the motor of another.",
        (FIRST,),
    ),
    Defect(
        "unsaid-drive-followed-by-any-family",
        "tui/drive/first_stop.py",
        "if alone is not None and alone.values == what.values:",
        "if alone is not None:",
        "The stop for the named family starts a motor that was just stopped.",
        (FIRST,),
    ),
    Defect(
        "first-word-not-in-the-journal",
        "tui/session/command/first_stop.py",
        "journal.add(_entry(line, device, what, answer))",
        "pass",
        "No record shows what stopped or moved a motor.",
        ("tests/session/test_first_stop.py::test_first_stop_is_in_the_journal",),
    ),
    Defect(
        "timeout-of-the-other-port-ignored",
        "tui/session/monitor/timeout.py",
        "for code in (rules.timeout, *rules.other_timeouts):",
        "for code in (rules.timeout,):",
        "A drive on its other port trips without a warning.",
        (TIMEOUT,),
    ),
    Defect(
        "watch-begun-by-others-not-seen",
        "tui/session/monitor/timeout.py",
        "return any(raws.get(code) for code in written)",
        "return False",
        "A drive that another program commanded trips after a read, without a warning.",
        (TIMEOUT,),
    ),
    Defect(
        "farewell-not-said-after-an-error",
        "tui/cli/shared/looking_after.py",
        "        finally:\n            try:",
        "        else:\n            try:",
        "A failed command leaves a timeout running and does not report it.",
        (f"{LEFT}::test_warning_is_shown_if_the_command_fails",),
    ),
    Defect(
        "signal-takes-what-was-done",
        "tui/cli/shared/looking_after.py",
        "                if not came:\n                    raise\n",
        "                raise\n",
        "A late SIGTERM gives a successful command a traceback and status 1.",
        (f"{LEFT}::test_signal_during_the_warning_keeps_the_result",),
    ),
    Defect(
        "silent-address-of-a-stop-counts-as-stopped",
        "tui/cli/commands/stop.py",
        "worst = max(worst, LINE_TROUBLE)",
        "worst = max(worst, 0)",
        "A script takes a motor whose drive did not answer for stopped.",
        ("tests/line/test_commands.py::test_stop_all_stops_every_drive",),
    ),
)
