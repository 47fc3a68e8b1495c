"""Defects of acceptance tests: a motor left running, and a drive that passes without a test."""

from __future__ import annotations

from .defect import Defect

MOTION = "tests/session/test_acceptance_motion.py"
RESULT = "tests/session/test_acceptance_result.py"
FILE = "tests/session/test_acceptance_file.py"
COMMAND = "tests/cli/test_accept.py"

PREDECESSOR = "tests/session/test_predecessor.py"

DEFECTS = (
    Defect(
        "acceptance-without-a-person",
        "tui/cli/running/keyboard.py",
        "    if not may_ask():\n        return False\n",
        "",
        "A script runs an acceptance test, and nobody is there to stop the motor.",
        (COMMAND,),
    ),
    Defect(
        "acceptance-not-confirmed",
        "tui/cli/commands/accept.py",
        'if not await says_yes(f"Carry out this test on device {console.device}?"):',
        'if await says_yes(f"Carry out this test on device {console.device}?") is None:',
        "An acceptance test moves the motor although the person said no.",
        (COMMAND,),
    ),
    Defect(
        "acceptance-of-a-running-motor",
        "tui/cli/commands/accept.py",
        'if state.motion in (*ENABLED_KINDS, "unknown"):',
        'if state.motion == "unknown":',
        "An acceptance test changes the speed of a motor that is at work.",
        (COMMAND,),
    ),
    Defect(
        "motion-not-awaited",
        "tui/session/acceptance/motion.py",
        "                await self._rest(following)\n",
        "",
        "An acceptance test goes on, or ends, while its motor still turns.",
        (MOTION,),
    ),
    Defect(
        "motion-left-when-cancelled",
        "tui/session/acceptance/motion.py",
        "            except asyncio.CancelledError as late:\n                cancelled = late\n",
        "            except asyncio.CancelledError:\n                raise\n",
        "An acceptance test that is interrupted does not wait for the standstill of its motor.",
        (MOTION,),
    ),
    Defect(
        "end-of-the-test-not-passed-on",
        "tui/session/acceptance/motion.py",
        "        ending.end(self.whole.why)\n",
        "",
        "The motor of an acceptance test runs on after Ctrl-C.",
        (MOTION,),
    ),
    Defect(
        "stop-of-another-program-overlooked",
        "tui/session/acceptance/motion.py",
        "        if self._others:\n            self.whole.end(self._others)\n",
        "",
        "An acceptance test starts the motor again that another program has just stopped.",
        (MOTION,),
    ),
    Defect(
        "lost-line-overlooked",
        "tui/session/acceptance/motion.py",
        "if self._failed_cycles >= FAILED_CYCLES:",
        "if self._failed_cycles > FAILED_CYCLES:",
        "An acceptance test goes on when the line is lost.",
        (MOTION,),
    ),
    Defect(
        "other-reference-overlooked",
        "tui/session/acceptance/motion.py",
        "elif self._is_other_reference():",
        "elif False:",
        "An acceptance test measures a speed that another master has set.",
        (MOTION,),
    ),
    Defect(
        "ramp-timed-in-part",
        "tui/session/acceptance/curve.py",
        "return (last - first) / (RAMP_TO - RAMP_FROM) * base / abs(way)",
        "return (last - first) * base / abs(way)",
        "A ramp of 3.7 s passes as 3.0 s.",
        (RESULT,),
    ),
    Defect(
        "step-not-run-passes",
        "tui/session/acceptance/result.py",
        'all(s.outcome == "passed" for s in self.steps)',
        'all(s.outcome != "failed" for s in self.steps)',
        "A drive passes although steps were not run.",
        (RESULT,),
    ),
    Defect(
        "changed-settings-pass",
        "tui/session/acceptance/result.py",
        "same = self.settings_hash and self.settings_hash == self.settings_after",
        "same = self.settings_hash",
        "A drive passes although its settings changed during the test.",
        (RESULT,),
    ),
    Defect(
        "frequency-without-a-range",
        "tui/drive/profile/form.py",
        "    if high is not None and value > high:\n",
        "    if high is not None and value > 10 * high:\n",
        "A test file runs a motor at 5000 Hz.",
        (FILE,),
    ),
    Defect(
        "endless-time-of-a-step",
        "tui/drive/profile/form.py",
        "    if not math.isfinite(value):\n",
        "    if False:\n",
        "A test file has a step without an end.",
        (FILE,),
    ),
    Defect(
        "unlike-setting-carried-over",
        "tui/drive/profile/schema/whole.py",
        "        if code in self.unlike:\n",
        "        if False:\n",
        "A raw value whose unit no source gives is written to a replacement drive.",
        (f"{PREDECESSOR}::test_settings_that_are_not_mapped_have_a_reason",),
    ),
    Defect(
        "predecessor-of-another-machine",
        "tui/session/settings/backups.py",
        "            if known and line_key(head.line) == key:\n",
        "            if known:\n",
        "A drive is offered the settings of a drive of another machine.",
        (f"{PREDECESSOR}::test_newest_backup_is_of_this_address",),
    ),
    Defect(
        "newest-set-written-unseen",
        "tui/cli/commands/restore.py",
        "    if newest and not dry_run:\n",
        "    if False:\n",
        "The set of a predecessor is written before a person has seen the differences.",
        ("tests/cli/test_replacement_command.py::test_newest_set_is_never_written_unseen",),
    ),
    Defect(
        "motor-data-of-the-machine",
        "tui/drive/settings/recipes.py",
        "                sets[0] = _without(sets[0], others)\n",
        "                pass\n",
        "The motor data of one drive is written to a drive with another motor.",
        ("tests/cli/test_recipes.py::test_recipes_are_restored_to_their_own_drives",),
    ),
    Defect(
        "changed-settings-reported-as-unchanged",
        "tui/session/stored_results.py",
        "    return result.settings_hash_after == now\n",
        "    return True\n",
        "A customer signs a test that was carried out with other settings.",
        (
            "tests/session/test_report_page.py"
            "::test_settings_that_changed_after_the_test_are_reported",
        ),
    ),
)
