"""Serial ports on Line: one entry for each, with the settings with which it was used last."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.screens.connection.choices import groups
from tui.session.connect.named_lines import LineSettings, NamedLine
from tui.session.connect.port_settings import PortSettings, with_last_settings
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


def settings_of(*lines: str) -> LineSettings:
    """A settings file with these lines."""
    named = {f"n{at}": NamedLine(f"n{at}", line) for at, line in enumerate(lines)}
    return LineSettings(Path("settings.toml"), named)


def test_port_of_a_named_line_is_not_listed_again(port: tuple[str, str]) -> None:
    real, link = port
    ports = [(real, "an adapter"), (f"{real}1", "another")]
    named, serial, *_ = groups(ports, [], settings_of(f"serial:{link},9600,8N1", "tcp:plc"))
    assert [choice.name for choice in named.choices] == ["n0", "n1"]
    assert [choice.text for choice in serial.choices] == [f"{real}1"]
    _, serial, *_ = groups(ports[:1], [], settings_of(f"serial:{link},9600,8N1"))
    assert (serial.choices, serial.empty) == ((), "")


@pytest.mark.parametrize(
    ("typed", "opened"),
    [
        ("{real}", "serial:{real},9600,8N1,timeout=2"),
        ("serial:{link}", "serial:{link},9600,8N1,timeout=2"),
        ("{real},timeout=1", "serial:{real},9600,8N1,timeout=1"),
        ("{real},4800", "{real},4800"),
        ("{real},9600,8E1", "{real},9600,8E1"),
        ("{real},19200,8E1", "{real},19200,8E1"),
        ("{real}1", "{real}1"),
        ("tcp:plc", "tcp:plc"),
        ("sim:atv71@1", "sim:atv71@1"),
    ],
)
def test_line_without_settings_has_those_of_its_last_use(
    port: tuple[str, str], typed: str, opened: str
) -> None:
    real, link = port
    recent = ["tcp:plc", f"serial:{link},9600,8N1,timeout=2", f"serial:{real},38400,8E1"]
    found = with_last_settings(typed.format(real=real, link=link), recent)
    assert found == opened.format(real=real, link=link)


async def test_offered_line_on_the_port_of_a_named_line_is_under_the_cursor(
    port: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    real, link = port
    ports = [(real, "")]
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", lambda: ports)
    settings = settings_of(f"serial:{link},9600,8N1")
    monkeypatch.setattr("tui.screens.connection.line_list.line_settings", lambda: settings)
    remember_line(f"serial:{real},38400,8E1")
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        lines = app.connection.lines
        lines.offer(f"serial:{real},9600,8N1")
        assert lines.chosen is not None
        assert lines.chosen.name == "n0"
        assert sum(real in c.text or link in c.text for c in lines._choices.values()) == 1
        lines.offer(f"serial:{real},4800,8N1")
        assert lines.chosen is not None
        assert lines.chosen.text == f"serial:{real},4800,8N1"
