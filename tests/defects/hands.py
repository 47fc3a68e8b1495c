"""Defects of what a person sees before a key, and what the key then does."""

from __future__ import annotations

from .defect import Defect

KEYS = ("tests/ui/test_dialog_keys.py",)

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
        "keys-of-a-long-question-out-of-sight",
        "tui/screens/dialogs/question.py",
        "part.styles.max_height = max(LEAST_ROWS, rows - part.styles.margin.height)",
        "part.styles.max_height = 30",
        "A question hides the end of what follows, or its keys, on a small terminal.",
        KEYS,
    ),
)
