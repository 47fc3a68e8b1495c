"""Rows of a drive without a fault: its last trip, and what has been monitored; pure functions."""

from __future__ import annotations

from rich.text import Text

from tui.drive.profile.schema import Quantity
from tui.session.monitor.watched import SeenTrip, Watched
from tui.widgets.drawing import wrapped
from tui.widgets.palette import FAINT, PLAIN

from .doctor_view import DoctorView
from .parts import LABEL, ago_text, dated_text, labelled

PEAKS: tuple[Quantity, ...] = ("output_frequency", "motor_current")


def quiet_rows(view: DoctorView, width: int) -> list[list[Text]]:
    """Return the last trip that is known, and since when and by whom the drive was monitored."""
    watched = view.watched
    if watched is None:
        return []
    room = max(10, width - LABEL - 1)
    trip = [Text(part, PLAIN) for part in wrapped(_trip_text(view, watched), room, 4)]
    seen = [_since_text(view, watched), *_gap_texts(view, watched)]
    rows = [Text(part, PLAIN) for text in seen for part in wrapped(text, room, 3)]
    rows += [Text(part, FAINT) for part in wrapped(_peak_text(view, watched), room, 2)]
    return [labelled("Last trip", trip), labelled("Monitored", rows)]


def _clock(view: DoctorView, moment: float) -> str:
    """Return the time of day of a monotonic moment."""
    return dated_text(view.wall - (view.now - moment), view.wall)


def _trip_text(view: DoctorView, watched: Watched) -> str:
    if watched.last is not None:
        return _seen_text(view, watched.last)
    since = watched.since
    if since is None:
        return "Not known: the drive has not been read yet."
    text = f"None seen since {_clock(view, since)}. Earlier trips are not known"
    if not watched.journal_read:
        return f"{text} yet: reading the journal."
    text = f"{text}: the journal of this computer has none."
    return f"{text} The drive's own history has no times." if view.history else text


def _seen_text(view: DoctorView, trip: SeenTrip) -> str:
    """Return a trip with its times; only what was monitored is known."""
    at = f"{dated_text(trip.wall, view.wall)}, {ago_text(view.wall - trip.wall)}"
    name = trip.fault or "A fault whose code is not known"
    text = f"{name}, tripped {at}." if trip.tripped else f"{name}, first seen {at}."
    if trip.reset is not None:
        text = f"{text} Reset {dated_text(trip.reset, view.wall)}."
    return f"{text} Trips while no program monitored it are not known."


def _since_text(view: DoctorView, watched: Watched) -> str:
    since, own = watched.since, watched.own
    if since is None:
        return "Not yet."
    if not watched.by_others:
        return f"By this panel since {_clock(view, since)}."
    by_others = f"By another program since {_clock(view, since)}"
    if own is None:
        return f"{by_others}."
    return f"{by_others}, by this panel since {_clock(view, own)}."


def _gap_texts(view: DoctorView, watched: Watched) -> list[str]:
    gaps = watched.gaps
    if not gaps:
        return []
    begin, end = gaps[-1]
    texts = f"Not read from {_clock(view, begin)} to {_clock(view, end)}"
    return [f"{texts}." if len(gaps) == 1 else f"{texts}, and {len(gaps) - 1} more times."]


def _peak_text(view: DoctorView, watched: Watched) -> str:
    """Return the largest values of the trend, with their times."""
    texts = []
    for quantity in PEAKS:
        parameter, found = view.profile.quantity(quantity), watched.highest(quantity)
        if parameter is not None and found is not None and parameter.unit:
            texts.append(f"{found[0]:.1f} {parameter.unit} at {_clock(view, found[1])}")
    return f"Highest in the last 10 min: {', '.join(texts)}." if texts else ""
