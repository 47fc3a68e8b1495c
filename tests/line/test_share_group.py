"""A line shared by the users of a group: off by default, and closed to other users."""

from __future__ import annotations

import grp
import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.programs import DRIVEPANEL, PATIENCE, end_keepers, served
from tui.simulator import DriveSpec, Simulation

ROOT = Path(__file__).resolve().parents[2]
GROUP, MEMBER, STRANGER = "dialout", 65533, 65534
ROOT_NEEDED = "needs root, to be two users"


@pytest.fixture
def tcp_line() -> Iterator[str]:
    """A simulated drive that every user can reach."""
    with Simulation([DriveSpec("atv71", 1)]) as simulation:
        host, port = simulation.serve_tcp()
        yield f"tcp:{host}:{port}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of the group that everybody may reach."""
    if os.geteuid() != 0:
        pytest.skip(ROOT_NEEDED)
    for part in (tmp_path, *tmp_path.parents):
        if part.stat().st_uid == 0 and not part.stat().st_mode & 0o001 and part != Path("/"):
            part.chmod(part.stat().st_mode | 0o011)
    found = tmp_path / "group"
    found.mkdir()
    os.chown(found, -1, grp.getgrnam(GROUP).gr_gid)
    found.chmod(0o2770)
    return found


PROGRAM = """
import grp, os, sys, tempfile
user, groups = int(sys.argv[1]), [int(g) for g in sys.argv[2].split(",") if g]
from tui.bus.errors import LineError
from tui.bus.share import client, server, sharing
from tui.session.connect import share_place
from tui.session.connect.open_line import open_line
# all that is imported later lies where another user may not look
open_line(sys.argv[3], wait=10.0).close()
os.setgroups(groups); os.setgid(user); os.setuid(user)
os.environ["DRIVEPANEL_STATE"] = tempfile.mkdtemp()
try:
    opened = open_line(sys.argv[3], wait=10.0, program="p" + sys.argv[1])
except LineError as error:
    print("ERROR", error, flush=True)
    sys.exit(1)
print([one.name for one in opened.line.facts.others], flush=True)
sys.stdin.readline()
opened.close()
"""


def program(line: str, user: int, groups: str, folder: Path, **more: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "DRIVEPANEL_SHARE_FOLDER": str(folder)}
    environment.pop("XDG_RUNTIME_DIR", None)
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(user), groups, line],
        cwd="/",
        env={**environment, **more},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def output(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def end(*programs: subprocess.Popen[str]) -> None:
    for program in programs:
        program.communicate("\n", timeout=20.0)


def test_group_member_attaches_without_setup_but_others_do_not(folder: Path, tcp_line: str) -> None:
    number = str(grp.getgrnam(GROUP).gr_gid)
    owner = program(tcp_line, MEMBER, number, folder, DRIVEPANEL_SHARE_GROUP=GROUP)
    assert output(owner) == "[]"
    member = program(tcp_line, MEMBER - 1, number, folder)
    assert output(member) == f"['p{MEMBER}']"
    stranger = program(tcp_line, STRANGER, "", folder)
    assert output(stranger) == "[]"
    end(member, stranger, owner)
    assert not list(folder.glob("*.sock"))


def test_other_users_attach_only_if_enabled(folder: Path, tcp_line: str) -> None:
    number = str(grp.getgrnam(GROUP).gr_gid)
    owner = program(tcp_line, MEMBER, number, folder)
    assert output(owner) == "[]"
    other = program(tcp_line, MEMBER - 1, number, folder)
    assert output(other) == "[]"
    end(other, owner)


def test_group_without_a_folder_gets_advice(tmp_path: Path, tcp_line: str) -> None:
    if os.geteuid() != 0:
        pytest.skip(ROOT_NEEDED)
    process = program(tcp_line, 0, "", tmp_path / "none", DRIVEPANEL_SHARE_GROUP=GROUP)
    reported = output(process)
    end(process)
    assert "sudo install -d -m 2770 -g dialout" in reported
    process = program(tcp_line, 0, "", tmp_path, DRIVEPANEL_SHARE_GROUP="no-such-group")
    reported = output(process)
    end(process)
    assert "There is no group no-such-group" in reported


def test_serve_opens_its_socket_for_the_group_that_is_configured(
    tmp_path: Path, tcp_line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One user is enough: the group is his own, the rest is done by the system."""
    groups = [*os.getgroups(), os.getgid()] if os.geteuid() else [grp.getgrnam(GROUP).gr_gid]
    number = next((group for group in groups if group != os.getgid()), os.getgid())
    folder = tmp_path / "group"
    folder.mkdir()
    os.chown(folder, -1, number)
    folder.chmod(0o2770)
    monkeypatch.setenv("DRIVEPANEL_SHARE_FOLDER", str(folder))
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    command = [*DRIVEPANEL, "serve", tcp_line]
    with served(command, ready="Ready:"):
        assert not list(folder.iterdir()), "closed to others unless told otherwise"
    with served([*command, "--share-group", grp.getgrgid(number).gr_name], ready="Ready:") as item:
        (socket,) = folder.glob("*.sock")
        reported = socket.stat()
        assert (reported.st_gid, stat.S_IMODE(reported.st_mode)) == (number, 0o660)
        watch = [*DRIVEPANEL, "watch", tcp_line, "RFR", "--count", "1", "--json"]
        done = subprocess.run(watch, capture_output=True, text=True, timeout=PATIENCE, check=False)
        assert done.returncode == 0
        assert "Shared with serve" in done.stderr
        assert item.end()[0] == 0
    end_keepers()
    assert not list(folder.glob("*.sock"))
