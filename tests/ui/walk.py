"""A path that takes every step between two places once, with the fewest visits."""

from __future__ import annotations

import itertools
from collections.abc import Iterable


def every_step(places: Iterable[str]) -> list[str]:
    """Places in an order in which each is followed by every place, itself included."""
    names = list(places)
    walk: list[str] = []
    for at, place in enumerate(names):
        walk += [place, place]
        for other in names[at + 1 :]:
            walk += [other, place]
    steps = set(itertools.pairwise(walk))
    assert steps == set(itertools.product(names, repeat=2))
    return walk
