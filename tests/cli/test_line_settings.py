"""Baud and format of a line without settings, and the advice if no drive answers."""

from __future__ import annotations

import sys

import pytest
from click.testing import CliRunner

from tests.programs import pty_pair
from tui.bus.link import SerialLink, UsualSettings, parse_link
from tui.cli.main import main
from tui.drive.profile import library

SLOW = UsualSettings(9600, "8N2")


@pytest.mark.parametrize(
    ("text", "baud", "format"),
    [
        ("serial:/dev/ttyUSB0", 9600, "8N2"),
        ("/dev/ttyUSB0", 9600, "8N2"),
        ("serial:/dev/ttyUSB0,timeout=2", 9600, "8N2"),
        ("serial:/dev/ttyUSB0,38400", 38400, "8N2"),
        ("serial:/dev/ttyUSB0,38400,8o1", 38400, "8O1"),
    ],
)
def test_profile_sets_the_line_settings(text: str, baud: int, format: str) -> None:
    link = parse_link(text, SLOW)
    assert isinstance(link, SerialLink)
    assert (link.baud, link.format) == (baud, format)


def test_line_without_a_profile_has_default_settings() -> None:
    assert parse_link("serial:/dev/ttyUSB0") == SerialLink("/dev/ttyUSB0", 19200, "8E1")


@pytest.fixture
def slow_family() -> str:
    """A profile whose drives have 9600 8N2 as factory setting."""
    folder = library.user_folder()
    folder.mkdir(parents=True)
    text = (library.packaged_folder() / "atv312.toml").read_text("utf-8")
    text = text.replace('id = "atv312"', 'id = "slow"', 1)
    text = text.replace("baud = 19200\n", "baud = 9600\n", 1)
    text = text.replace('format = "8E1"\n', 'format = "8N2"\n', 1)
    text = text.replace('role = "baud"\nfactory = 32', 'role = "baud"\nfactory = 28', 1)
    text = text.replace('role = "format"\nfactory = 3', 'role = "format"\nfactory = 5', 1)
    (folder / "slow.toml").write_text(text, "utf-8")
    library.load.cache_clear()
    assert library.load("slow").data.link.baud == 9600
    return "slow"


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")
@pytest.mark.parametrize(
    ("settings", "more", "reported"),
    [
        ("", ["-p", "slow"], "9600 baud and 8N2 (the profile's own)"),
        (",38400,8E1", ["-p", "slow"], "38400 baud and 8E1 (as typed)"),
        ("", ["-p", "atv312"], "19200 baud and 8E1 (the profile's own)"),
    ],
)
def test_no_answer_suggests_to_check_the_settings(
    slow_family: str, settings: str, more: list[str], reported: str
) -> None:
    with pty_pair() as (near, _):
        done = CliRunner().invoke(main, ["read", f"serial:{near}{settings}", "ACC", *more])
    assert done.exit_code == 3
    assert reported in done.output
    assert "did not answer" in done.output
