"""Claims that `profiles --prove` did not test, because the file does not make them."""

from __future__ import annotations

from collections.abc import Sequence

from tui.drive.profile.profile import Profile

from .proof_bench import ProofStep


def untested(profile: Profile, steps: Sequence[ProofStep]) -> list[str]:
    """Return a sentence for each important subject that no step tested, with what the file
    lacks."""
    data = profile.data
    places = {step.path[0] for step in steps}
    orders = {order.id for chart in data.charts for order in chart.orders}
    titles = [step.title for step in steps]
    tested = {
        "Commands and stops: there are no [[charts]] with orders.": "charts" in places,
        "Reverse: there is no order reverse.": "reverse" in orders or "forward" not in orders,
        "References: there are no [[references]] with a unit, or no order forward.": any(
            title.endswith(" agree") for title in titles
        ),
        "The output frequency: no parameter has the quantity output_frequency.": bool(
            profile.quantity("output_frequency")
        ),
        "Fault numbers: there are no codes in [faults].": bool(data.faults.codes),
        "Communication loss: there is no [communication_fault] with a timeout and a chart.": (
            "communication_fault" in places
        ),
        "Saving: there is no [memory.save], or no setting that waits for it.": any(
            title.startswith("settings are saved") for title in titles
        ),
        "Addresses and word order: there are no [[frames]] of the manual.": "frames" in places,
    }
    return [text for text, is_tested in tested.items() if not is_tested]
