"""Registration of Trend: its title, description and keys."""

from __future__ import annotations

from ..keys.action import Registration, key_rows

REGISTERED = (
    Registration(
        title="Trend",
        about="up to four parameters of any drives over 10 s to 24 h: from the record, and live",
        digit="8",
        narrow="Trd",
        screen="trend.screen.TrendScreen",
        actions=key_rows(
            ("move_cursor(-1)", "left", "", "Move the cursor back in time; the curves are held."),
            ("move_cursor(1)", "right", "", "Move the cursor forward in time."),
            ("mark", "M", "mark", "Set mark A, then mark B, at the cursor; then remove both."),
            ("trend_window(-1)", "<", "", "Shorten the time of the curves, down to 10 s."),
            ("trend_window(1)", ">", "window", "Lengthen the time of the curves, up to 24 h."),
            ("hold", "h", "hold", "Hold the curves, or let them run."),
            (
                "pick_band",
                "enter",
                "value",
                "Choose the parameter of the band, or go to the event.",
            ),
            ("pick_drive", ":", "", "Choose the drive of the band, then its parameter."),
            ("other_page", "tab", "", "Go to the events, or back to the curves."),
            ("move(-1)", "up", "", "Select the band above, or a newer event."),
            ("move(1)", "down", "", "Select the band below, or an older event."),
            ("page(-1)", "pageup", "", "Show an earlier time."),
            ("page(1)", "pagedown", "", "Show a later time."),
            ("oldest", "home", "", "Show the oldest values of the record."),
            ("newest", "end", "", "Show the present values, and let the curves run."),
            ("leave", "escape", "", "Close the events or the cursor; else go back to Monitor."),
        ),
    ),
)
