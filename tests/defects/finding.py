"""Defects of the search for drives: what it sends, whom it finds, and when it asks a person."""

from __future__ import annotations

from .defect import Defect

SCAN = "tests/cli/test_scan.py"
SEARCH = "tests/session/test_search.py"
MASTERS = "tests/session/test_other_masters.py"
FIND = "tests/session/test_find_drive.py"
SETTINGS = "tests/ui/test_other_settings.py"
FAMILIES = "tests/drive/test_finding.py"

DEFECTS = (
    Defect(
        "scan-among-another-masters-requests",
        "tui/cli/running/scanning.py",
        "if text := (await listen_first(line, LISTEN)).text:",
        "if (text := (await listen_first(line, LISTEN)).text) and False:",
        "A running plant's controller loses its answers while drives are searched for.",
        (f"{SCAN}::test_another_master_ends_it_before_anything_is_sent",),
    ),
    Defect(
        "busy-master-not-heard",
        "tui/bus/rtu/master.py",
        "if len(self._idle) < MUCH_TALK:",
        "if True:",
        "A master that leaves no long silences is not noticed, and disturbed.",
        (f"{MASTERS}::test_a_master_is_heard_on_a_line_on_which_nothing_is_sent",),
    ),
    Defect(
        "late-echo-taken-for-a-master",
        "tui/session/connect/other_masters.py",
        "elif frame.time < since or frame.data in ours:",
        "elif frame.time < since:",
        "With an adapter that echoes late, no drive is ever found.",
        (f"{MASTERS}::test_what_is_no_master",),
    ),
    Defect(
        "empty-address-waited-for",
        "tui/session/connect/search.py",
        "silent = await first(self.devices, Priority.BACKGROUND, how.within)",
        "silent = await first(self.devices, Priority.BACKGROUND, None)",
        "To search 31 addresses takes ten times as long.",
        (f"{SEARCH}::test_an_empty_address_costs_one_request_and_the_longest_turnaround",),
    ),
    Defect(
        "late-answer-not-asked-again",
        "tui/session/connect/search.py",
        "            if late:\n",
        "            if late and not self._once:\n",
        "A drive with a long response delay is not found.",
        (f"{SEARCH}::test_who_answers_too_late_is_heard_and_asked_again",),
    ),
    Defect(
        "silent-read-ends-the-finding",
        "tui/session/connect/identify.py",
        "            refused |= isinstance(error, DeviceException)\n",
        "            refused |= False\n",
        "Altivar drives, which refuse the read that finds Leroy-Somer, are not found.",
        (f"{FIND}::test_who_refuses_the_read_says_who_it_is",),
    ),
    Defect(
        "likely-drive-left-alone",
        "tui/bus/schedule/patience.py",
        "asked_now = within is not None or priority < Priority.POLL",
        "asked_now = priority < Priority.POLL",
        "A drive without function 43 is not asked by 17, and not polled for a second once found.",
        ("tests/bus/test_api.py::test_who_looks_whether_a_silent_device_is_there_waits_for_no_back_off",),
    ),
    Defect(
        "slow-settings-first",
        "tui/drive/finding.py",
        "-float(shares[one]) / cost, -one.baud, one.format",
        "-float(shares[one]), one.baud, one.format",
        "A search over all settings spends its first minute at 300 baud.",
        (f"{FAMILIES}::test_of_two_that_are_as_likely_the_faster_comes_first",),
    ),
    Defect(
        "other-settings-unasked",
        "tui/cli/running/scanning.py",
        "        if not (self.yes or may_ask()):\n",
        "        if False:\n",
        "A script lets a motor coast, as its drive is asked no more.",
        (f"{SCAN}::test_without_a_terminal_no_other_setting_is_tried_where_a_drive_would_act",),
    ),
    Defect(
        "found-drives-not-held",
        "tui/cli/running/scanning.py",
        "        fleet.take(session, guessed=result.identity.profile is None)\n",
        "",
        "A drive trips while the person reads the question about it.",
        (f"{SCAN}::test_drives_are_held_while_the_person_decides",),
    ),
    Defect(
        "shared-line-scanned-at-other-settings",
        "tui/cli/commands/scan.py",
        "    if others := line.facts.others:\n",
        "    if (others := line.facts.others) and False:\n",
        "The panel beside it loses its drives, which trip.",
        (f"{SCAN}::test_a_line_that_others_use_is_not_taken_for_other_settings",),
    ),
    Defect(
        "hits-lost-at-ctrl-c",
        "tui/cli/commands/scan.py",
        "    except KeyboardInterrupt:\n",
        "    except ZeroDivisionError:\n",
        "Whoever ends a long search does not learn what it came to.",
        (f"{SCAN}::test_ctrl_c_keeps_what_was_found",),
    ),
    Defect(
        "unknown-drive-left-alone",
        "tui/session/fleet.py",
        "self._strangers.keep(identity.device)",
        "pass",
        "A drive of no known family trips while a person looks up which one it is.",
        (f"{SETTINGS}::test_drives_are_asked_on_while_the_person_decides_known_or_not",),
    ),
    Defect(
        "unclear-answer-passed-by",
        "tui/screens/connection/other_settings.py",
        "if self.found or self.search.answered:",
        "if self.found:",
        "Two drives at one address are asked once and left alone, unasked.",
        (f"{SETTINGS}::test_where_an_answer_is_no_reply_no_other_setting_is_tried_unasked",),
    ),
    Defect(
        "families-not-named",
        "tui/screens/connection/scanning.py",
        "self.families = await asyncio.to_thread(_families)",
        'self.families = ""',
        "Nobody knows before the search that a drive will watch the line from then on.",
        (f"{SETTINGS}::test_who_may_be_there_is_named_before_the_first_request",),
    ),
    Defect(
        "second-round-not-counted",
        "tui/session/connect/search.py",
        "return first + LATE_WAIT + (self._silent.times + still) * self._cost_again",
        "return first",
        "A search that says that a second is left takes ten.",
        (f"{SEARCH}::test_what_is_left_counts_the_silent_ones_once_more_and_what_they_really_take",),
    ),
    Defect(
        "slow-settings-unannounced",
        "tui/cli/running/scanning.py",
        "if self.costs is None or not later[0].slow or any(one.slow for one in self.tried[1:]):",
        "if True:",
        "A search that is as good as done goes on for a minute and a half, and nobody knows why.",
        (f"{SCAN}::test_what_is_slow_is_told_before_it_is_tried",),
    ),
    Defect(
        "drive-being-proved-told-silent",
        "tui/session/connect/search.py",
        "if hushed := line.facts.hushed.get(device):",
        "if False and (hushed := ('', '')):",
        "Who comes to a line looks for a broken wire, at a drive that is being proved.",
        (f"{SEARCH}::test_a_drive_that_is_left_alone_on_purpose_is_no_silent_one",),
    ),
    Defect(
        "unclear-answer-told-silent",
        "tui/screens/connection/scanning.py",
        "if not self.found and self.search is not None and self.search.answered:",
        "if False:",
        "It is said that nobody answers where two drives answer at once.",
        (f"{SETTINGS}::test_where_an_answer_is_no_reply_no_other_setting_is_tried_unasked",),
    ),
)  # fmt: skip
