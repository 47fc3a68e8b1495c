"""Invalid files, endless ones, or endlessly nested ones: each is reported in a sentence."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from .commands import ended, invoked, refused, run

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of POSIX")

PUMP = "sim:atv71@1"


def pipe(path: Path) -> None:
    os.mkfifo(path)


def zeros(path: Path) -> None:
    path.symlink_to("/dev/zero")


def folder(path: Path) -> None:
    path.mkdir()


def loop(path: Path) -> None:
    path.symlink_to(path)


def long(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(60_000_000_000)


def text(content: str | bytes) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    return make


FILES: dict[str, tuple[Callable[[Path], None], str]] = {
    "pipe": (pipe, "not a regular file"),
    "zeros": (zeros, "not a regular file"),
    "folder": (folder, "s a directory"),
    "loop": (loop, "symbolic links"),
    "long": (long, "longer than 2000 kB"),
    "deep list": (text("a = " + "[" * 200_000), "too deep"),
    "deep table": (text("a = " + "{a = " * 100_000), "too deep"),
    "deep key": (text("a." * 300_000 + "b = 1"), "too deep"),
    "deep quoted key": (text('"a".' * 200_000 + "b = 1"), "too deep"),
    "deep head": (text("[" + "a." * 300_000 + "b]"), "too deep"),
    "long number": (text("a = " + "9" * 5000), "4300 digits"),
    "no text": (text(b"\xff\xfe"), "UTF-8"),
    "binary": (text(os.urandom(2000)), ""),
    "nothing": (text(""), ""),
}


@pytest.fixture(params=FILES)
def odd(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    """A file, and the text reported about it."""
    make, reported = FILES[request.param]
    path = tmp_path / "odd.toml"
    make(path)
    return path, reported


def test_hostile_file_as_a_profile_is_refused(odd: tuple[Path, str]) -> None:
    assert odd[1] in refused(2, "profiles", "--check", odd[0])


def test_hostile_file_as_a_parameter_set_is_refused(odd: tuple[Path, str]) -> None:
    assert odd[1] in refused(2, "compare", odd[0], "factory")


def test_hostile_file_as_a_block_file_is_refused(odd: tuple[Path, str]) -> None:
    assert odd[1] in refused(2, "block", PUMP, "load", odd[0], "--dry-run")


def test_hostile_file_among_own_profiles_does_not_affect_others(
    odd: tuple[Path, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("DRIVEPANEL_CONFIG", str(tmp_path / "own"))
    (tmp_path / "own" / "profiles").mkdir(parents=True)
    odd[0].rename(tmp_path / "own" / "profiles" / "odd.toml")
    assert "odd" in run(0, "profiles")
    assert "atv71" in run(0, "identify", PUMP)


STATE = (
    "recent-lines.json",
    "addresses.json",
    "marks-atv71.json",
    "user-words.json",
    "terminals.json",
    "journal.jsonl",
    "starts",
    "taught",
    "drivepanel.log.1",
)


@pytest.mark.parametrize("make", [pipe, zeros, folder, loop, text(b"\xff" * 50), text("[" * 99999)])
def test_hostile_file_in_the_state_folder_blocks_no_write_and_no_stop(
    make: Callable[[Path], None],
) -> None:
    state = Path(os.environ["DRIVEPANEL_STATE"])
    state.mkdir()
    for name in STATE:
        make(state / name)
    for command in (
        ("write", PUMP, "ACC=4.0", "--arm"),
        ("stop", PUMP),
        ("status", PUMP),
        ("read", PUMP, "ACC"),
    ):
        ended(0, *command)
    done = invoked("journal")
    assert done.exit_code in (0, 2)
    assert "Traceback" not in done.output
