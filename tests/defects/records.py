"""Defects of what is put on record, and of what files and drives of any content do."""

from __future__ import annotations

from .defect import Defect

DEFECTS = (
    Defect(
        "half-a-line-not-marked",
        "tui/session/journal_file.py",
        'b"\\n" + _mark() + line',
        'b"\\n" + line',
        "Nobody sees that a crash cut an entry of the journal off.",
        ("tests/session/test_journal_file.py::test_half_a_line_is_kept_and_marked",),
    ),
    Defect(
        "half-a-line-swallows-the-next",
        "tui/session/journal_file.py",
        'line if end[-1:] in (b"", b"\\n") else',
        "line if True else",
        "The first write behind a crash is not on record.",
        ("tests/session/test_journal_file.py::test_half_a_line_is_kept_and_marked",),
    ),
    Defect(
        "programs-take-no-turns",
        "tui/session/journal_file.py",
        "fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)",
        "pass",
        "Two programs that write at a time lose a file of the journal.",
        ("tests/session/test_journal_file.py",),
    ),
    Defect(
        "full-disk-leaves-half-a-line",
        "tui/session/journal_file.py",
        "os.ftruncate(handle, start)",
        "pass",
        "A full disk leaves the journal with damage that nothing did.",
        ("tests/session/test_journal_file.py",),
    ),
    Defect(
        "journal-open-to-all",
        "tui/session/journal_file.py",
        "OWN_MODE = 0o600",
        "OWN_MODE = 0o644",
        "Everybody on the computer reads what was written to the drives.",
        ("tests/session/test_journal_file.py::test_the_journal_is_its_owners_alone",),
    ),
    Defect(
        "last-entries-left-behind",
        "tui/session/journal.py",
        "atexit.register(ending)",
        "pass",
        "The last write before a program ends is not on record.",
        (
            "tests/session/test_journal_file.py"
            "::test_a_program_that_ends_puts_its_last_entries_down",
        ),
    ),
    Defect(
        "journal-trouble-not-told-at-once",
        "tui/session/journal.py",
        "if why and not before:\n                self._cry()",
        "if before and not why:\n                self._cry()",
        "A run of an hour says at its end only that nothing of it is on record.",
        ("tests/session/test_journal_file.py::test_trouble_is_told_at_once_and_once",),
    ),
    Defect(
        "lost-answer-not-completed",
        "tui/session/settings/write.py",
        "answer, lost = str(error), True",
        "answer, lost = str(error), False",
        "The journal never tells what became of a write whose answer was lost.",
        ("tests/session/test_writing.py::test_a_lost_answer_is_completed_once_the_drive_is_read",),
    ),
    Defect(
        "lost-answer-completed-by-another-write",
        "tui/session/image.py",
        "self._asked_of.pop(code, None)\n            self._doubted",
        "self._doubted",
        "The journal says that a lost write was taken, by the value of the next one.",
        (
            "tests/session/test_writing.py"
            "::test_a_lost_answer_is_not_completed_by_what_a_later_write_left",
        ),
    ),
    Defect(
        "log-of-a-full-disk-tells-tracebacks",
        "tui/cli/shared/logs.py",
        "    def handleError(",
        "    def handle_error(",
        "A full disk answers a stop that worked with six tracebacks.",
        (
            "tests/cli/test_journal_trouble.py"
            "::test_a_full_disk_is_said_in_a_sentence_and_nothing_else_fails",
        ),
    ),
    Defect(
        "lost-output-fails-a-stop",
        "tui/cli/shared/standard_streams.py",
        '"run", "stop", ',
        '"run", ',
        "A script takes a stop that worked for a failed one, as its disk is full.",
        (
            "tests/cli/test_journal_trouble.py"
            "::test_what_was_done_is_not_said_to_have_failed_as_its_output_is_lost",
        ),
    ),
    Defect(
        "no-journal-not-on-the-strip",
        "tui/widgets/strip.py",
        "    if view.off_record:\n        text.append(off_record, ALARM)\n",
        "",
        "The panel commands motors and nobody sees that nothing is on record.",
        ("tests/ui/test_strip.py",),
    ),
    Defect(
        "early-frame-taken-over-rtu",
        "tui/bus/rtu/master.py",
        "await self._transport.take_in()",
        "await asyncio.sleep(0)",
        "An answer that came before its question is shown as the present value.",
        ("tests/bus/test_hostile_peers.py::test_what_came_before_a_request_is_not_its_answer",),
    ),
    Defect(
        "early-frame-taken-over-tcp",
        "tui/bus/tcp/master.py",
        "await self._transport.take_in()",
        "await asyncio.sleep(0)",
        "A gateway that counts along answers before it is asked, and is believed.",
        (
            "tests/bus/test_hostile_peers.py"
            "::test_what_came_before_a_request_is_not_its_answer_by_a_guessed_number",
        ),
    ),
    Defect(
        "loop-looks-once-only",
        "tui/bus/transport/tcp.py",
        "        await asyncio.sleep(0)\n        await asyncio.sleep(0)\n",
        "        await asyncio.sleep(0)\n",
        "An answer that came before its question is shown as the present value.",
        ("tests/bus/test_hostile_peers.py::test_a_connection_hands_over_what_the_system_holds",),
    ),
    Defect(
        "flood-is-kept",
        "tui/bus/rtu/exchange.py",
        "if len(self.buffer) > FLOOD:",
        "if len(self.buffer) < 0:",
        "A device server that sends noise holds every stop of its line up for minutes.",
        (
            "tests/bus/test_hostile_peers.py"
            "::test_a_reply_is_found_behind_a_flood_and_the_flood_is_not_kept",
        ),
    ),
    Defect(
        "reply-behind-a-flood-overlooked",
        "tui/bus/rtu/exchange.py",
        "max(0, len(self.buffer) - MAX_FRAME)",
        "max(0, len(self.buffer))",
        "Drives behind a noisy adapter do not answer any more.",
        ("tests/bus/test_rtu.py", "tests/bus/test_hostile_peers.py"),
    ),
)
