"""Registration of Frames, and of Listening, its mode for a line that is only monitored."""

from __future__ import annotations

from ..keys.action import Registration, key_rows

LISTING = key_rows(
    ("hold", "h", "pause", "Pause or resume the list."),
    ("other_page", "tab", "view", "Show the next view: values, bytes, counters or summary."),
    ("only", "O", "filter", "Filter the frames by drive, function or error: 2-read-error."),
    ("find_frame", "j", "", "Find frames by drive, function, error or text."),
    ("scroll(-1)", "up", "", "Show older frames; pauses the list."),
    ("scroll(1)", "down", "", "Show newer frames."),
    ("scroll(-10)", "pageup", "", "Go back ten frames."),
    ("scroll(10)", "pagedown", "", "Go forward ten frames."),
)
"""Actions of both Frames and Listening."""


REGISTERED = (
    Registration(
        title="Frames",
        about="requests and replies on the line",
        digit="7",
        narrow="Frm",
        screen="frames.screen.FramesScreen",
        actions=(
            *LISTING,
            *key_rows(
                (
                    "reset_counters",
                    "C",
                    "",
                    "Restart the counts of this panel; other programs keep theirs.",
                ),
                (
                    "reset_drive_counters",
                    "Z",
                    "",
                    "Set the drive's own counters to 0. Needs arming; asks first.",
                ),
                ("leave", "escape", "back", "Clear the filter, then return to Monitor."),
            ),
        ),
    ),
    Registration(
        title="Listening",
        tab="Frames",
        about="the traffic of other masters and their drives; a mode of Frames",
        key="H",
        actions=(
            *LISTING,
            *key_rows(("leave", "escape", "end", "Clear the filter, then end listening.")),
        ),
    ),
)
