"""`drivepanel simulate --about`: the simulated behavior of a family, with its sources."""

from __future__ import annotations

from ..documents.other_documents import BehaviorField, SimulatedBehaviorDocument
from ..shared.output import print_json
from ..shared.say import say


def show_about(name: str, as_json: bool) -> None:
    """Print how a simulated drive of a profile behaves, and where that is from."""
    from tui.drive.profile.library import load
    from tui.simulator.about import behaviors_of

    profile = load(name.casefold())
    found = behaviors_of(profile)
    if as_json:
        behaviors = [
            BehaviorField(text=item.text, provenance=item.provenance, source=item.source)
            for item in found
        ]
        print_json(SimulatedBehaviorDocument(profile=profile.id, behaviors=behaviors))
        return
    say(f"Simulated {profile.name}: printed in its manual, public elsewhere, or a guess.")
    for item in found:
        say(f"{item.provenance:<8} {item.text} ({item.source})", indent=9)
