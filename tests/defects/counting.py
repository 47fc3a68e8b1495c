"""Defects of the counters, and of what Frames shows."""

from __future__ import annotations

from .defect import Defect

COMPARED = ("tests/session/test_counters.py",)
MINUTE = ("tests/bus/test_minute.py",)
HEALTH = ("tests/session/test_line_health.py",)

DEFECTS = (
    Defect(
        "roll-over-not-undone",
        "tui/session/counters/compare.py",
        "found = (now - before) % MODULO",
        "found = now - before",
        "After 65536 frames the drive shows a negative count.",
        COMPARED,
    ),
    Defect(
        "counter-reset-not-seen",
        "tui/session/counters/compare.py",
        "if frames is None or now.damaged < self.last.damaged:",
        "if frames is None:",
        "After a power cycle the drive shows a negative number of errors.",
        COMPARED,
    ),
    Defect(
        "uncertain-taken-for-certain",
        "tui/session/counters/compare.py",
        "missed = min(frames, found.sent.low) - damaged - found.answered.high",
        "missed = min(frames, found.sent.high) - damaged - found.answered.low",
        "A request in flight at the moment of the count is reported as a lost answer.",
        COMPARED,
    ),
    Defect(
        "refusal-counted-to-no-drive",
        "tui/bus/tally.py",
        "self.of(device).count_exception(code)",
        "self.of(0).count_exception(code)",
        "A refusal is counted for the wrong drive.",
        ("tests/bus/test_counters.py",),
    ),
    Defect(
        "hidden-field-takes-the-focus",
        "tui/screens/frames/frame_list.py",
        'AUTO_FOCUS: ClassVar = ""',
        'AUTO_FOCUS: ClassVar = "#typed"',
        "Space on Frames goes into a hidden field, and stops no motor.",
        ("tests/ui/test_frames_screen.py::test_nothing_has_the_focus_so_that_space_stops",),
    ),
    Defect(
        "unanswered-is-no-error",
        "tui/screens/frames/choice.py",
        "return unanswered and requested is not None and requested.device != BROADCAST_DEVICE",
        "return unanswered and requested is None",
        "Requests without an answer are missing when only errors are shown.",
        ("tests/ui/test_frame_choice.py",),
    ),
    Defect(
        "reset-off-record",
        "tui/session/counters/watch.py",
        "journal.add(_reset_entry(self.session, answer))",
        "pass",
        "No record shows who reset the drive's counters that others use to find lost frames.",
        ("tests/session/test_counters.py::test_drive_counters_are_reset_and_compared_from_zero",),
    ),
    Defect(
        "dead-drive-spoils-the-line",
        "tui/bus/schedule/outcomes.py",
        "tally.count_good(device, was_heard=record.ever_answered and short)",
        "tally.count_good(device, was_heard=True)",
        "A drive that was off for an hour makes the line count as poor.",
        MINUTE,
    ),
    Defect(
        "late-replies-taken-for-strays",
        "tui/bus/schedule/outcomes.py",
        'elif kind != "late":',
        "else:",
        "A slow drive is taken for two drives at one address.",
        MINUTE,
    ),
    Defect(
        "foreign-frames-raise-no-alert",
        "tui/session/monitor/line_health.py",
        'if line.foreign >= (1 if "foreign" in before else SEVERAL_FRAMES):',
        "if line.foreign and self._poor:",
        "Another master commands the drives, and the panel reports the line as good.",
        HEALTH,
    ),
    Defect(
        "alert-that-flickers",
        "tui/session/monitor/line_health.py",
        "return share < (HEALTHY if was_poor else POOR)",
        "return share < POOR",
        "The alert of a poor line appears and disappears each second, until it is ignored.",
        HEALTH,
    ),
    Defect(
        "trouble-hidden-behind-arming",
        "tui/widgets/strip.py",
        'form = next((form for form in forms if len(form) <= room), "")',
        'form = next((form for form in forms if len(form) <= 0), "")',
        "The line loses a tenth of its replies, and the status bar shows nothing of it.",
        ("tests/ui/test_strip.py",),
    ),
)
