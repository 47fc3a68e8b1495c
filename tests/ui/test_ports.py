"""Serial ports on Line: one entry for each, with the settings with which it was used last."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.screens.connection.choices import PortSettings, groups
from tui.session.paths import remember_line

from . import fakes

LASTING = "usb-FTDI_FT232R_A50285BI-if00-port0"


@pytest.fixture
def port(tmp_path: Path) -> tuple[str, str]:
    """A port and a lasting name that leads to it."""
    real, link = tmp_path / "ttyUSB0", tmp_path / LASTING
    real.touch()
    link.symlink_to(real)
    return str(real), str(link)


def test_port_has_one_entry_whatever_name_it_was_used_by(port: tuple[str, str]) -> None:
    real, link = port
    recent = [f"serial:{link},9600,8N1,timeout=2", f"serial:{real},19200,8E1", "tcp:plc"]
    serial, lately, _ = groups([(real, "an adapter")], recent)
    assert [choice.text for choice in serial.choices] == [real]
    assert serial.choices[0].settings == PortSettings(9600, "8N1", 2.0)
    assert [choice.text for choice in lately.choices] == ["tcp:plc"]


def test_port_that_is_not_plugged_in_stays_a_recent_line(port: tuple[str, str]) -> None:
    real, link = port
    recent = [f"serial:{link},9600,8N1"]
    _, lately, _ = groups([(f"{real}1", "another")], recent)
    assert [choice.text for choice in lately.choices] == recent


async def test_next_start_uses_the_settings_that_were_found(
    port: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    real, link = port
    other = f"{real}1"
    ports = [(real, ""), (other, "")]
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: ports)
    remember_line(f"serial:{link},9600,8N1,timeout=2")
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        screen = app.connection

        def line() -> str:
            choice = screen.lines.chosen
            assert choice is not None
            return screen.line_of(choice)

        assert line() == f"serial:{real},9600,8N1,timeout=2"
        screen.lines.focus()
        await pilot.press("down")
        assert line() == f"serial:{other},19200,8E1", "settings of one port are not another's"
        await pilot.press("up")
        assert line() == f"serial:{real},9600,8N1,timeout=2"
        screen.form.show_settings(4800, "8N2")
        screen.lines.fill("", [])
        assert line() == f"serial:{real},4800,8N2,timeout=2", "what was typed stays"
