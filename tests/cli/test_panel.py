"""Arguments that the command line passes to the panel, and the exit."""

from __future__ import annotations

from typing import Any

import pytest
from click.testing import CliRunner

from tui.__main__ import main as run
from tui.bus.errors import PortBusy
from tui.cli.main import main
from tui.cli.shared.errors import LINE_TROUBLE, USAGE
from tui.session.connect.open_line import open_line


class FakePanel:
    """Replaces the panel; records its arguments."""

    given: dict[str, Any]
    ends_with = 0

    def __init__(self, **given: Any) -> None:
        type(self).given = given
        self.return_code: int | None = None

    def run(self) -> None:
        self.return_code = self.ends_with


@pytest.fixture
def panel(monkeypatch: pytest.MonkeyPatch) -> type[FakePanel]:
    """A panel that is not drawn, on a terminal that is none."""
    monkeypatch.setattr("tui.cli.commands.panel.terminal_trouble", str)
    monkeypatch.setattr("tui.app.DrivePanelApp", FakePanel)
    monkeypatch.setattr(FakePanel, "ends_with", 0)
    return FakePanel


@pytest.mark.parametrize(
    ("arguments", "start", "device", "read_only"),
    [
        ((), None, None, False),
        (("--read-only",), None, None, True),
        (("-v",), None, None, False),
        (("tcp:10.0.0.5",), "tcp:10.0.0.5", None, False),
        (("-v", "tcp:10.0.0.5", "-d", "7"), "tcp:10.0.0.5", 7, False),
        (("--read-only", "sim:atv71@2", "-d", "2"), "sim:atv71@2", 2, True),
        (("./read", "-d", "3"), "./read", 3, False),
    ],
)
def test_panel_opens_on_the_typed_line(
    panel: type[FakePanel],
    arguments: tuple[str, ...],
    start: str | None,
    device: int | None,
    read_only: bool,
) -> None:
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    given = panel.given
    assert (given["start"], given["device"], given["read_only"]) == (start, device, read_only)
    assert given["open_line"] is open_line


def test_start_without_arguments_parses_nothing(
    panel: type[FakePanel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.cli.opening.terminal_trouble", str)
    monkeypatch.setattr("sys.argv", ["drivepanel"])
    monkeypatch.setattr(panel, "ends_with", 1)
    with pytest.raises(SystemExit) as ended:
        run()
    assert ended.value.code == 1
    assert (panel.given["start"], panel.given["device"]) == (None, None)


def test_error_without_arguments_is_reported_as_by_every_command(
    panel: type[FakePanel], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail(panel: FakePanel) -> None:
        raise PortBusy("/dev/ttyUSB0")

    monkeypatch.setattr("tui.cli.opening.terminal_trouble", str)
    monkeypatch.setattr("sys.argv", ["drivepanel"])
    monkeypatch.setattr(panel, "run", fail)
    with pytest.raises(SystemExit) as ended:
        run()
    assert ended.value.code == LINE_TROUBLE
    assert capfd.readouterr().err.startswith("drivepanel: /dev/ttyUSB0 is in use")


def test_start_without_a_terminal_is_refused(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["drivepanel"])
    with pytest.raises(SystemExit) as ended:
        run()
    assert ended.value.code == USAGE
    assert "needs a terminal" in capfd.readouterr().err


def test_demo_opens_its_own_line(panel: type[FakePanel]) -> None:
    assert CliRunner().invoke(main, ["demo"]).exit_code == 0
    opened = panel.given["open_line"]("demo", read_only=False, wait=4.0)
    try:
        profiles = [drive.profile.id for drive in opened.simulation.drives]
        assert profiles == ["atv21", "atv31", "atv312", "atv71", "powerdrive"]
        assert opened.devices == (1, 2, 3, 4, 5)
    finally:
        opened.close()


def test_line_typed_for_the_demo_is_used(
    panel: type[FakePanel], monkeypatch: pytest.MonkeyPatch
) -> None:
    requested: list[tuple[str, dict[str, Any]]] = []
    monkeypatch.setattr(
        "tui.session.connect.open_line.open_line", lambda text, **how: requested.append((text, how))
    )
    assert CliRunner().invoke(main, ["demo"]).exit_code == 0
    panel.given["open_line"]("/dev/ttyUSB0", read_only=True, wait=4.0)
    assert requested == [("/dev/ttyUSB0", {"read_only": True, "wait": 4.0, "program": ""})]


def test_panel_that_ended_by_an_error_exits_with_1(
    panel: type[FakePanel], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(panel, "ends_with", 1)
    assert CliRunner().invoke(main, []).exit_code == 1


@pytest.mark.parametrize("command", [(), ("demo",), ("tcp:10.0.0.5",)])
def test_mouse_is_enabled_only_on_request(panel: type[FakePanel], command: tuple[str, ...]) -> None:
    for options, mouse in (((), False), (("--mouse",), True)):
        result = CliRunner().invoke(main, [*command, *options])
        assert result.exit_code == 0, result.output
        assert panel.given["mouse"] is mouse
