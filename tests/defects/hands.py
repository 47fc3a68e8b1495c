"""Defects of what a person sees before a key, and what the key then does."""

from __future__ import annotations

from .defect import Defect

KEYS = ("tests/ui/test_dialog_keys.py",)
ARMING_KEY = "tests/ui/test_stop_keys.py"

DEFECTS = (
    Defect(
        "space-promised-where-it-is-text",
        "tui/screens/frame.py",
        "typing=takes_space(self.focused))",
        "typing=False)",
        "A dialog says that Space stops, and it is typed into the name of a file.",
        KEYS,
    ),
    Defect(
        "stop-key-told-once",
        "tui/screens/frame.py",
        "            parts[DIALOG_KEYS] = [key_line(stops)]",
        "            parts.setdefault(DIALOG_KEYS, [] if self._frame_parts else [key_line(stops)])",
        "What stops is told as it was before the cursor went into a text.",
        KEYS,
    ),
    Defect(
        "typed-name-takes-the-stop-away",
        "tui/session/fleet.py",
        "        if before is not None and before.session.known_identity == identity:\n"
        "            return\n",
        "",
        "A slip in the name of a profile, and no key stops the motor that runs.",
        ("tests/ui/test_found.py",),
    ),
    Defect(
        "running-motor-taken-for-another-family",
        "tui/session/fleet.py",
        "runs = any(one is before for one in self.line_watch.under_command())",
        "runs = False",
        "A motor that was started here goes on when the panel is left, and nobody is asked.",
        ("tests/ui/test_found.py",),
    ),
    Defect(
        "stop-that-reaches-nobody-is-silent",
        "tui/screens/hands.py",
        '            self.events.add("failed", told)\n            if strangers',
        "            if False and strangers",
        "F9 stops all but one drive, and says nothing of it.",
        ("tests/ui/test_stop_keys.py",),
    ),
    Defect(
        "counters-reset-unarmed",
        "tui/screens/frames/counter_keys.py",
        "Task(self._reset_drive, owner=self.console), stamp",
        "Task(self._reset_drive, armed=False)",
        "A drive is written to though its arming has ended while a question stood.",
        ("tests/ui/test_frames_screen.py",),
    ),
    Defect(
        "arming-behind-a-stop",
        "tui/session/work.py",
        "if stamp == self.stops:\n                self.arming.arm(",
        "if True:\n                self.arming.arm(",
        "A stop comes while the key that arms has its effect, and the drive stays armed.",
        ("tests/session/test_command.py", ARMING_KEY),
    ),
    Defect(
        "arming-key-not-asked-anew",
        "tui/screens/command/arming.py",
        "if stroke is not None and stroke.stamp != self.app.stop_stamp():",
        "if stroke is not None and stroke.stamp is None:",
        "A stop comes just before the key that arms has its effect, and the drive stays armed.",
        (ARMING_KEY,),
    ),
    Defect(
        "named-like-a-key",
        "tui/screens/dialogs/question.py",
        "self._voided = self._answered = False\n",
        "self._voided = self._answered = False\n        self._key_at = 0.0\n",
        "Who types @ while a question stands ends the panel, and every motor with it.",
        ("tests/ui/test_keys.py",),
    ),
    Defect(
        "typed-on-into-a-question",
        "tui/screens/dialogs/question.py",
        "return now - max(self._drawn, self._typed_at) < NOT_TYPING",
        "return now - self._drawn < self.SETTLED",
        "Who types a word with a y in it writes what a question that has just come asks about.",
        ("tests/ui/test_questions.py",),
    ),
    Defect(
        "report-cuts-a-stop-key",
        "tui/terminal/dialects.py",
        "        self._late_until = self._late_before\n        if self._cut is not None:",
        "        if False and self._cut is not None:",
        "Behind tmux a link cuts F12 in two, a report comes in between, and nothing stops.",
        ("tests/terminal/test_dialects.py",),
    ),
    Defect(
        "long-name-ends-the-panel",
        "tui/screens/dialogs/files.py",
        "except OSError as error:",
        "except FileExistsError as error:",
        "A long text is pasted for the name of a file, and the panel ends, motors and all.",
        ("tests/ui/test_dialog_keys.py",),
    ),
    Defect(
        "keys-of-a-long-question-out-of-sight",
        "tui/screens/dialogs/question.py",
        "part.styles.max_height = max(LEAST_ROWS, rows - part.styles.margin.height)",
        "part.styles.max_height = 30",
        "A question hides the end of what follows, or its keys, on a small terminal.",
        KEYS,
    ),
)
