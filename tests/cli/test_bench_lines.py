"""Lines for the bench from a script and a socket."""

from __future__ import annotations

import json
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from tui.cli.running.bench_lines import BenchSocket, script_lines
from tui.simulator import Bench, DriveSpec, Simulation

from ..simulator.small import PROFILES


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench(Simulation([DriveSpec("atv71", 2)], profiles=PROFILES))
    yield made
    made.close()


def test_script_is_read_without_comments(bench: Bench, tmp_path: Path) -> None:
    script = tmp_path / "trip.bench"
    script.write_text("# a rehearsal\n2: jam  # the shaft\n\nat 3.5s: 2: trip OCF\n")
    assert script_lines(bench, str(script)) == ["2: jam", "at 3.5s: 2: trip OCF"]


def test_wrong_line_of_a_script_is_named_before_anything_is_done(
    bench: Bench, tmp_path: Path
) -> None:
    script = tmp_path / "trip.bench"
    script.write_text("2: jam\n2: explode\n")
    with pytest.raises(click.UsageError, match=r"line 2: 'explode'"):
        script_lines(bench, str(script))
    assert not bench.do("2: state")[0].state.jammed


def answers(path: Path, sent: bytes, count: int) -> list[dict[str, object]]:
    with socket.socket(socket.AF_UNIX) as client, client.makefile("r") as lines:
        client.settimeout(20)
        client.connect(str(path))
        client.sendall(sent)
        return [json.loads(lines.readline()) for _ in range(count)]


def test_socket_answers_several_lines_in_their_order(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "bench"
    served = BenchSocket(bench, str(path))
    found = answers(path, b"2: jam\n2: nonsense\n2: trip OCF\n", 3)
    assert [row["event"] for row in found] == ["bench", "refused", "bench"]
    assert found[0]["drive"]["jammed"]  # type: ignore[index]
    assert found[2]["drive"]["fault"] == "OCF"  # type: ignore[index]
    served.close()
    assert not path.exists()


def test_socket_is_for_its_user_alone(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "bench"
    served = BenchSocket(bench, str(path))
    assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0
    served.close()


def test_socket_in_use_is_refused_and_a_left_one_is_replaced(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "bench"
    first = BenchSocket(bench, str(path))
    with pytest.raises(click.UsageError, match="in use"):
        BenchSocket(bench, str(path))
    assert answers(path, b"2: state\n", 1)[0]["event"] == "bench"
    first.close()
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(path))
    second = BenchSocket(bench, str(path))
    assert answers(path, b"2: state\n", 1)[0]["event"] == "bench"
    second.close()


def test_file_at_the_path_of_a_socket_stays(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "notes"
    path.write_text("keep")
    with pytest.raises(click.UsageError, match="cannot be served"):
        BenchSocket(bench, str(path))
    assert path.read_text() == "keep"
