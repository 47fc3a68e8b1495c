"""Commands and writes of an unproved profile that the evidence of this site has proved."""

from __future__ import annotations

from .profile.profile import Profile
from .profile.schema import Chart, Parameter
from .words import unsigned

NEVER_NEEDED = frozenset({"emergency-stop"})
"""Commands that need no proof: a stop is never refused, and this one trips the drive."""


def unproved_commands(profile: Profile) -> set[str]:
    """Return the ids of commands, and the codes of references, that this site has not proved."""
    orders = (order for chart in profile.data.charts for order in chart.orders)
    found = {o.id for o in orders if o.confidence != "site"} - NEVER_NEEDED
    references = (profile[way.parameter] for way in profile.data.references)
    quantities = (profile.quantity("command_frequency"), profile.quantity("command_speed"))
    words = {p.code: p for p in (*references, *quantities) if p is not None}
    return found | {code for code, p in words.items() if p.confidence != "site"}


def is_proved_write(profile: Profile, parameter: Parameter, raw: int) -> bool:
    """Return True if this site has proved a write: a word of a command, or a proved parameter."""
    charts = profile.data.charts
    targets = {chart.command for chart in charts}
    targets |= {order.parameter for chart in charts for order in chart.orders}
    if parameter.code in targets:
        return any(unsigned(raw) in _proved_words(chart, parameter.code) for chart in charts)
    return parameter.confidence == "site"


def _proved_words(chart: Chart, code: str) -> set[int]:
    """Return the words of proved commands to a register, with those of a start step by step."""
    proved = [order for order in chart.orders if order.confidence == "site"]
    words = {w for o in proved for w in o.words if (o.parameter or chart.command) == code}
    if chart.runs_in is not None and any(o.id in ("forward", "reverse") for o in proved):
        words |= {t.command for t in chart.transitions if t.command is not None}
    return {unsigned(word) for word in words}
