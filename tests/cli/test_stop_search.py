"""`drivepanel stop --all`: the order of the addresses, and the patience with each."""

from __future__ import annotations

import importlib
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import click
import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineLost
from tui.cli.shared.errors import Failure

stop = importlib.import_module("tui.cli.commands.stop")


class Stops:
    """A line on which each address does in turn what is planned; and what is asked of it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **planned: list[Any]) -> None:
        self.planned = {int(name[1:]): results for name, results in planned.items()}
        self.calls: list[Any] = []
        self.started: dict[int, str] = {}
        self.status = 0
        monkeypatch.setattr(stop, "found_at", self._found)
        monkeypatch.setattr(stop, "first_stopped", self._blind)
        monkeypatch.setattr(stop, "remembered", self._remembered)
        monkeypatch.setattr(stop, "look_after", lambda *_: None)
        monkeypatch.setattr(stop, "_seen_through", self._through)
        self.telling = Mock()

    async def _remembered(self, _: object) -> dict[int, str]:
        return self.started

    async def _found(self, _: object, device: int, before: object, patience: Priority) -> Any:
        self.calls.append((device, patience.name.lower()))
        return self._next(device)

    async def _blind(self, _: object, device: int, before: object) -> Any:
        self.calls.append((device, "blind"))
        return self._next(device)

    def _next(self, device: int) -> Any:
        result = self.planned[device].pop(0)
        if isinstance(result, Exception):
            raise result
        return result and SimpleNamespace(session=device)

    async def _through(self, _: object, found: Any, __: object) -> int:
        self.calls.append(f"stop {found.session}")
        return self.status

    async def all(self, named: list[int], known: tuple[int, ...] = (), profile: str = "") -> int:
        opened = SimpleNamespace(devices=known, line=Mock(), text="L")
        wish = SimpleNamespace(
            opened=opened, profile_id=profile or None, journal=None, telling=self.telling
        )
        status: int = await stop._stop_all(wish, named)
        return status

    @property
    def reports(self) -> list[Any]:
        return [(name, *words) for name, words, _ in self.telling.method_calls]


FOUND = True


async def test_silent_addresses_are_tried_again_after_all_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stops = Stops(monkeypatch, d1=[None, FOUND], d2=[FOUND], d3=[LineLost("Cut."), None])
    assert await stops.all([], known=(1, 2, 3)) == 3
    first = [(device, "background") for device in (1, 2, 3)]
    again = [(1, "operator_read"), (3, "operator_read")]
    assert [item for item in stops.calls if isinstance(item, tuple)] == first + again
    assert {item for item in stops.calls if isinstance(item, str)} == {"stop 1", "stop 2"}
    assert stops.reports == [("silent", [3], 3)]


async def test_usual_addresses_are_searched_on_an_unknown_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    silent: dict[str, Any] = {f"d{device}": [None, None] for device in range(1, 11)}
    stops = Stops(monkeypatch, **{**silent, "d4": [LineLost("Damaged."), FOUND], "d7": [FOUND]})
    stops.status = 4
    assert await stops.all([]) == 4
    assert [item for item in stops.calls if item[1] == "operator_read"] == [(4, "operator_read")]
    assert len([item for item in stops.calls if item[1] == "patient"]) == 8
    assert stops.reports == [("silent", [1, 2, 3, 5, 6, 8, 9, 10], 0)]
    nobody = Stops(monkeypatch, **{f"d{device}": [None, None] for device in range(1, 11)})
    assert await nobody.all([]) == 3


async def test_motors_that_were_started_here_are_stopped_first_and_blindly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stops = Stops(monkeypatch, d1=[FOUND], d9=[None, FOUND])
    stops.started = {9: "record"}
    assert await stops.all([], known=(1,)) == 0
    assert [item for item in stops.calls if isinstance(item, tuple)] == [
        (9, "background"), (1, "background"), (9, "blind"),
    ]  # fmt: skip
    named = Stops(monkeypatch, d5=[None, None])
    assert await named.all([5], profile="atv71") == 3
    assert named.calls == [(5, "background"), (5, "blind")]


async def test_drive_that_cannot_be_stopped_hinders_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refused, nameless = Failure("Device 1: NOT STOPPED.", 3), click.UsageError("Use -p.")
    stops = Stops(monkeypatch, d1=[refused], d2=[nameless], d3=[FOUND])
    assert await stops.all([1, 2, 3]) == 4
    assert "stop 3" in stops.calls
    assert stops.reports == [
        ("failed", 1, None, "Device 1: NOT STOPPED.", 3),
        ("failed", 2, None, stop.NAMES_NO_FAMILY.format(2), 4),
    ]
