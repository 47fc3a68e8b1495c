"""Numeric options take finite numbers within limits, and no rate that a line cannot achieve."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from tui.bus.link import Link, SerialLink, TcpLink
from tui.cli.command_index import COMMANDS
from tui.cli.main import main
from tui.cli.shared.errors import USAGE, Failure
from tui.cli.shared.numbers import FiniteRange, check_rate

from .commands import refused, tcp_line

NOT_NUMBERS = ["nan", "inf", "-inf", "infinity", "1e400", "-1e400", "x", ""]


def numeric_options() -> Iterator[tuple[str, click.Parameter]]:
    """Every option of every command that takes a number."""
    with click.Context(main) as context:
        for name in COMMANDS:
            command = main.get_command(context, name)
            assert command is not None
            subcommands = getattr(command, "commands", {})
            for subcommand in (command, *subcommands.values()):
                for parameter in subcommand.params:
                    if isinstance(
                        parameter.type,
                        click.types.FloatParamType | click.types.IntParamType,
                    ):
                        yield f"{name} {parameter.opts[0]}", parameter


OPTIONS = dict(numeric_options())


def test_number_options_of_all_commands_are_found() -> None:
    assert {"run --for", "watch --every", "serve --fresh", "simulate --run"} <= OPTIONS.keys()


@pytest.mark.parametrize("name", OPTIONS)
def test_option_refuses_all_but_finite_numbers_in_range(name: str) -> None:
    parameter = OPTIONS[name]
    kind = parameter.type
    if isinstance(kind, click.types.FloatParamType):
        assert isinstance(kind, FiniteRange)
        assert kind.min is not None
        assert kind.max is not None
        outside = [str(kind.min - 1), str(kind.max * 2)]
    else:
        outside = [str(kind.min - 1)] if isinstance(kind, click.IntRange) and kind.min else []
    for text in (*NOT_NUMBERS, *outside):
        with pytest.raises(click.BadParameter):
            kind.convert(text, parameter, None)


@pytest.mark.parametrize("seconds", ["nan", "inf", "1e400", "0", "-1"])
def test_run_for_an_infinite_time_exits_with_2(seconds: str) -> None:
    with tcp_line("atv71@1") as line:
        message = refused(2, "run", line, "--reference", "20Hz", "--arm", "--for", seconds)
        assert "--for" in message


@pytest.mark.parametrize("rate", ["nan", "inf", "2", "-0.1", "x"])
def test_simulate_refuses_an_invalid_share(rate: str) -> None:
    assert "KIND=VALUE" in refused(
        2, "simulate", "atv71", "--tcp", "127.0.0.1:0", "--line-fault", f"late={rate}"
    )


@pytest.mark.parametrize(
    ("link", "every", "drives", "possible"),
    [
        (SerialLink("/dev/x", 19200), 0.05, 1, True),
        (SerialLink("/dev/x", 19200), 0.05, 31, False),
        (SerialLink("/dev/x", 19200), 1.0, 31, True),
        (SerialLink("/dev/x", 1200), 0.1, 1, False),
        (SerialLink("/dev/x", 1200), 0.3, 1, True),
        (TcpLink("host", 502), 0.05, 100, True),
    ],
)
def test_rate_is_refused_if_the_line_cannot_achieve_it(
    link: Link, every: float, drives: int, possible: bool
) -> None:
    if possible:
        check_rate(link, every, drives)
        return
    with pytest.raises(Failure) as refusal:
        check_rate(link, every, drives)
    assert refusal.value.status == USAGE
    assert "Use a longer cycle" in refusal.value.message


FIVE_DRIVES = ",".join(f"atv71@{device}" for device in range(1, 6))
EACH_DRIVE = [word for device in range(1, 6) for word in ("-d", str(device))]


@pytest.mark.parametrize(
    "command",
    [
        ("watch", *EACH_DRIVE, "RFR", "--csv", "new"),
        ("record", *EACH_DRIVE, "RFR", "--out", "new"),
        ("publish", *EACH_DRIVE, "RFR", "--mqtt", "mqtt://127.0.0.1:1"),
        ("serve", "--metrics", "127.0.0.1:0"),
    ],
    ids=lambda command: command[0],
)
def test_cycle_too_short_for_all_drives_of_the_line_is_refused(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of them alone could be read in that time."""
    monkeypatch.chdir(tmp_path)
    name, *more = command
    message = refused(2, name, f"sim:{FIVE_DRIVES}", *more, "--every", "0.05")
    assert "reading one word from 5 drives takes 0.063 s" in message
    assert not Path("new").exists()
