"""The tables of `link`: a start, the keys, and what goes on at rest."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.terminal import Figures

STEPS = {"first": "first picture", "state": "state readable", "complete": "Monitor complete"}
START_AIMS = {
    ("2 kB/s, 300 ms", "state"): "at most 4 s",
    ("20 kB/s, 100 ms", "complete"): "at most 1.5 s",
}
KEY_AIM = 0.3
"""Seconds over a round trip within which a key is acted on."""
REST_AIM = "500"


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title)
    for number, column in enumerate(columns):
        table.add_column(column, justify="right" if number else "left")
    return table


def show_starts(console: Console, link: str, figures: dict[str, Figures]) -> None:
    """Print what each program takes from its start to each picture."""
    aims = [aim and f", aim {aim}" for aim in (START_AIMS.get((link, step), "") for step in STEPS)]
    table = _table(
        f"{link}: from the start of the program, s (median, worst; bytes on the link)",
        "",
        "login",
        *(f"{title}{aim}" for title, aim in zip(STEPS.values(), aims, strict=True)),
    )
    for name, found in figures.items():
        start = found["start"]
        table.add_row(name, *(_step(start, step) for step in ("login", *STEPS)))
    console.print(table)


def _step(start: Figures, step: str) -> str:
    times = start.get(f"{step}_s")
    if times is None:
        return ""
    size = start[f"{step}_link_bytes"]["median"]
    return f"{times['median']:.2f}, {times['worst']:.2f}; {size:.0f}"


def show_keys(console: Console, link: str, round_trip: float, figures: dict[str, Figures]) -> None:
    """Print what keys take over a round trip of the link."""
    table = _table(
        f"{link}: from a key, s over a round trip of {round_trip:g} s",
        "",
        "key",
        "presses",
        f"first cell: median, worst (aim {KEY_AIM:g})",
        "all of it: median, worst",
        "lost",
    )
    for name, found in figures.items():
        for key, times in found["keys"].items():
            table.add_row(
                name,
                key,
                str(times["presses"]),
                _over(times["first"], round_trip),
                _over(times["complete"], round_trip),
                str(times["complete"]["lost"]),
            )
    console.print(table)


def _over(times: Any, round_trip: float) -> str:
    if times["median_s"] is None:
        return "never"
    return f"{times['median_s'] - round_trip:+.2f}, {times['worst_s'] - round_trip:+.2f}"


def show_rest(console: Console, link: str, figures: dict[str, Figures]) -> None:
    """Print bytes at rest, and how late the screen is."""
    table = _table(
        f"{link}: at rest, and how late the screen is, s (median, worst)",
        "",
        f"bytes a second (aim, low bandwidth: {REST_AIM})",
        "on the link",
        "clock on it behind",
        "a fault to its word",
        "running again to its word",
    )
    for name, found in figures.items():
        rest, trips = found["rest"], found["trips"] or {}
        table.add_row(
            name,
            f"{rest['bytes_a_second']:.0f}",
            f"{rest['link_bytes_a_second']:.0f}",
            _pair(rest["clock_behind_s"], "median", "worst"),
            _pair(trips.get("fault"), "median_s", "worst_s"),
            _pair(trips.get("running"), "median_s", "worst_s"),
        )
    console.print(table)


def _pair(found: Any, middle: str, most: str) -> str:
    return "" if found is None else f"{found[middle]:.2f}, {found[most]:.2f}"
