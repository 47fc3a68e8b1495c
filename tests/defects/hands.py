"""Defects of keys: the texts before a key, and its effect."""

from __future__ import annotations

from .defect import Defect

KEYS = ("tests/ui/test_dialog_keys.py",)
ARMING_KEY = "tests/ui/test_stop_keys.py"
OPENING = "tests/ui/test_opening.py"

DEFECTS = (
    Defect(
        "space-promised-where-it-is-text",
        "tui/screens/frame.py",
        "typing=takes_space(self.focused))",
        "typing=False)",
        "A dialog says that Space stops, but Space is typed into a file name.",
        KEYS,
    ),
    Defect(
        "stop-key-told-once",
        "tui/screens/frame.py",
        "            parts[DIALOG_KEYS] = [key_line(stops)]",
        "            parts.setdefault(DIALOG_KEYS, [] if self._frame_parts else [key_line(stops)])",
        "The stop key shown is not updated when the cursor enters a text field.",
        KEYS,
    ),
    Defect(
        "typed-name-takes-the-stop-away",
        "tui/session/fleet.py",
        "        if before is not None and before.session.known_identity == identity:\n"
        "            return\n",
        "",
        "After a typing error in a profile name, no key stops the running motor.",
        ("tests/ui/test_found.py",),
    ),
    Defect(
        "running-motor-taken-for-another-family",
        "tui/session/fleet.py",
        "runs = any(item is before for item in self.line_watch.under_command())",
        "runs = False",
        "The panel closes without a question while a motor that it started runs.",
        ("tests/ui/test_found.py",),
    ),
    Defect(
        "unreached-stop-is-silent",
        "tui/screens/app_port.py",
        '    panel.events.add("failed", text)\n    panel.unreached = text,',
        "    _ = text,",
        "F9 stops all but one drive without reporting that one.",
        ("tests/ui/test_stop_keys.py",),
    ),
    Defect(
        "not-stopped-cut-off",
        "tui/screens/frame.py",
        "                *not_stopped_lines(view.not_stopped, width),\n",
        "",
        "The commander of a motor that did not stop is truncated or covered.",
        ("tests/ui/test_stop_keys.py::test_not_stopped_message_is_never_covered",),
    ),
    Defect(
        "broken-key-reader-stops-nothing",
        "tui/terminal/reader.py",
        "                self._stops.last_stop(error)\n",
        "                pass\n",
        "An error in reading the keys disables the stop key.",
        ("tests/terminal/test_reader.py",),
    ),
    Defect(
        "error-behind-a-stop-key-loses-it",
        "tui/screens/key_dispatcher.py",
        "                fleet.last_stop(error, chosen)\n",
        "                pass\n",
        "An error in the panel disables the stop key.",
        ("tests/ui/test_stop_keys.py::test_error_after_a_stop_key_does_not_prevent_its_frame",),
    ),
    Defect(
        "counters-reset-unarmed",
        "tui/screens/frames/screen.py",
        "Task(self._reset_drive, owner=self.console), stamp",
        "Task(self._reset_drive, armed=False)",
        "A drive is written to although its arming ended while a question was open.",
        ("tests/ui/test_frames_screen.py",),
    ),
    Defect(
        "arming-behind-a-stop",
        "tui/session/work.py",
        "if stamp == self.stops:\n                self.arming.arm(",
        "if True:\n                self.arming.arm(",
        "A stop arrives while the arm key takes effect, and the drive stays armed.",
        ("tests/session/test_command.py", ARMING_KEY),
    ),
    Defect(
        "arming-key-not-checked-again",
        "tui/screens/command/arming.py",
        "if stroke is not None and stroke.stamp != self.app.stop_stamp():",
        "if stroke is not None and stroke.stamp is None:",
        "A stop arrives just before the arm key takes effect, and the drive stays armed.",
        (ARMING_KEY,),
    ),
    Defect(
        "keys-count-while-a-line-opens",
        "tui/screens/key_dispatcher.py",
        "if name in STOP_KEYS or self.screen.is_modal:",
        "if True:",
        "Keys typed while the demo opens open a real line of an earlier day instead.",
        (
            f"{OPENING}::test_tour_keys_typed_too_early_open_no_line_and_work_later",
            f"{OPENING}::test_stops_work_while_a_second_line_opens",
        ),
    ),
    Defect(
        "key-read-while-a-line-opens-counts-later",
        "tui/screens/key_dispatcher.py",
        "if stroke is None or stroke.read_at > self.opening.ended:",
        "if True:",
        "A key that a slow panel handles late opens a drive or another line.",
        (f"{OPENING}::test_key_read_while_a_line_opens_is_ignored_even_if_handled_later",),
    ),
    Defect(
        "search-left-without-a-question",
        "tui/screens/connection/line_keys.py",
        "asks = here is not None or self.scanning",
        "asks = here is not None",
        "Enter on another line closes the line being searched, without a question.",
        (f"{OPENING}::test_enter_on_another_line_asks_during_the_scan",),
    ),
    Defect(
        "named-like-a-key",
        "tui/screens/dialogs/question.py",
        "self._voided = self._answered = False\n",
        "self._voided = self._answered = False\n        self._key_at = 0.0\n",
        "Typing @ while a question is open closes the panel and stops every motor.",
        ("tests/ui/test_keys.py",),
    ),
    Defect(
        "typed-on-into-a-question",
        "tui/screens/dialogs/question.py",
        "return now - max(self._drawn, self._typed_at) < ANSWER_COUNTS_AFTER",
        "return now - self._drawn < self.SETTLED",
        "A typed word with a y in it confirms a question that has just appeared.",
        ("tests/ui/test_questions.py",),
    ),
    Defect(
        "report-cuts-a-stop-key",
        "tui/terminal/dialects.py",
        "        self._late_until = self._late_before\n        if self._cut is not None:",
        "        if False and self._cut is not None:",
        "In tmux, a terminal report splits an F12 that the link cut in two, and nothing stops.",
        ("tests/terminal/test_dialects.py",),
    ),
    Defect(
        "long-name-ends-the-panel",
        "tui/screens/dialogs/ask.py",
        "except OSError as error:",
        "except FileExistsError as error:",
        "Pasting a long text as a file name ends the panel and its motors.",
        ("tests/ui/test_dialog_keys.py",),
    ),
    Defect(
        "keys-of-a-long-question-out-of-sight",
        "tui/screens/dialogs/question.py",
        "part.styles.max_height = max(least, rows - part.styles.margin.height)",
        "part.styles.max_height = 30",
        "On a small terminal a question hides its last lines or its keys.",
        KEYS,
    ),
)
