"""Defects of output to the terminal: when a frame is sent, and how much of it."""

from __future__ import annotations

from .defect import Defect

PACE = ("tests/terminal/test_pacing.py",)

DEFECTS = (
    Defect(
        "reports-keep-a-sequence-waiting",
        "tui/terminal/dialects.py",
        "*cut, self._last = self._cut",
        "*cut, _ = self._cut",
        "After Esc and [, digits and the next letter are ignored: k does not stop.",
        ("tests/terminal/test_dialects.py::test_reports_do_not_keep_a_sequence_waiting",),
    ),
    Defect(
        "reply-without-backslash-takes-the-next-escape",
        "tui/terminal/dialects.py",
        "self._began, self._mark, self._state = began, mark, self._escape",
        "self._began, self._mark, self._state = began, mark, self._ground",
        "An F12 directly after a truncated reply of the terminal does not stop.",
        (
            "tests/terminal/test_dialects.py::test_reply_that_loses_its_backslash_gives_no_alt_key",
            "tests/terminal/test_dialects.py::test_stop_key_after_a_cut_or_incomplete_reply_stops",
        ),
    ),
    Defect(
        "frames-not-waited-for",
        "tui/terminal/lean_app.py",
        "        if on_its_way and sum(on_its_way) > ahead and",
        "        if len(on_its_way) > 8 and sum(on_its_way) > ahead and",
        "Over a slow link the panel shows the motor's state of seconds ago.",
        PACE,
    ),
    Defect(
        "what-hurries-waits-too",
        "tui/terminal/lean_app.py",
        "AHEAD_OF_REST if rest else AHEAD if hurry else 0",
        "AHEAD_OF_REST if rest else 0",
        "Over a slow link a stop is shown only after the frame before it.",
        PACE,
    ),
    Defect(
        "lost-answer-waited-for-for-ever",
        "tui/terminal/lean_app.py",
        "for at, size in self._requested if now < at + self._patience]",
        "for at, size in self._requested]",
        "The panel freezes on a terminal that never answers.",
        PACE,
    ),
    Defect(
        "mute-terminal-taken-for-slow",
        "tui/terminal/lean_app.py",
        "            not self._answers\n            and bool(self._requested)\n",
        "            False\n            and bool(self._requested)\n",
        "On a terminal that never answers, a stop is shown seconds late.",
        PACE,
    ),
    Defect(
        "slow-link-never-learnt",
        "tui/terminal/lean_app.py",
        "self._piece = max(PIECE_LEAST, int(size * PIECE_TIME / took))",
        "self._piece = WHOLE",
        "Over a slow link every key waits for a whole frame.",
        PACE,
    ),
    Defect(
        "fast-link-never-learnt",
        "tui/terminal/lean_app.py",
        "            self._piece = min(WHOLE, GROWTH * self._piece)\n",
        "            self._piece = PIECE_LEAST\n",
        "A fast link gets its frames in small pieces, each after an answer.",
        PACE,
    ),
    Defect(
        "panel-without-its-terminal",
        "tui/terminal/driver.py",
        "    except TerminalGone:\n        os.kill(os.getpid(), signal.SIGHUP)\n",
        "    except TerminalGone:\n",
        "A panel that lost its terminal keeps its motor running, without a person.",
        ("tests/terminal/test_driver.py::test_lost_terminal_ends_the_panel_with_a_hangup",),
    ),
)
