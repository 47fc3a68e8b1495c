"""The first picture is complete, and unchanged once the fields exist."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from rich.color import ColorSystem
from textual.widgets import Input

from tui.app import DrivePanelApp
from tui.terminal.lean import cells_of

from .test_flows import until

pytestmark = pytest.mark.drawn


def picture(app: Any) -> list[list[tuple[str, str]]]:
    """Every cell with its colors, but for the strip, which has the time of day."""
    return [cells_of(strip, ColorSystem.TRUECOLOR) for strip in app._last_strips()[1:]]


class FirstPicture(DrivePanelApp):
    """Records the first picture that is sent to the terminal."""

    first: list[list[tuple[str, str]]] | None = None
    fields_then = 0
    on_first: Callable[[], None] | None = None

    def _last_strips(self) -> Any:
        return self.screen._compositor.render_strips()

    def _display(self, screen: Any, renderable: Any) -> None:
        super()._display(screen, renderable)
        if renderable is not None and not self._batch_count and self.first is None:
            self.first = picture(self)
            self.fields_then = len(self.screen.query(Input))
            if self.on_first is not None:
                self.on_first()


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (60, 20), (200, 60)])
@pytest.mark.parametrize("ports", [[], [("/dev/ttyUSB0", "USB-RS485 adapter")]])
@pytest.mark.sweep
async def test_late_fields_do_not_change_the_first_picture(
    ports: list[tuple[str, str]], size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: list(ports))
    app = FirstPicture()
    async with app.run_test(size=size) as pilot:
        await until(pilot, lambda: len(app.connection.form.query(Input)) == 4)
        await pilot.pause()
        assert app.first is not None
        assert app.fields_then == 0, "the first picture waits for none of them"
        assert app.first == picture(app)


async def test_form_values_do_not_wait_for_fields() -> None:
    app = DrivePanelApp()
    async with app.run_test() as pilot:
        form = app.connection.form
        form.offer_addresses("3, 5")
        assert form.addresses() == [3, 5]
        assert form.line_at("/dev/ttyUSB0") == "serial:/dev/ttyUSB0,19200,8E1"
        await until(pilot, lambda: len(form.query(Input)) == 4)
        assert form.query_one("#addresses", Input).value == "3, 5"


async def test_field_focused_before_it_exists_gets_the_cursor() -> None:
    app = FirstPicture()
    app.on_first = lambda: app.connection.form.ask_for_addresses()
    async with app.run_test() as pilot:
        await until(pilot, lambda: getattr(app.focused, "id", "") == "addresses")
