"""A computer of a plant in namespaces: systemd as its first process, with log-ins and users.

Its writes stay in memory, above the files of this computer. Needs root.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.sources import ROOT

NAMESPACES = ("-fpmCiun", "--kill-child")
"""For unshare: processes, mounts, control groups, IPC, host name and network are its own."""
GROUP, SERVICE, USERS = "drivepanel", "drivepanel", 8
"""The group that shares lines, the user of the service, and how many others there are."""
LINGERS = "stays"
"""A user whose processes outlive the session."""
STARTS_WITHIN, ENDS_WITHIN = 60.0, 10.0
PLACE = "/var/chaos"
"""Folder in which each program of each user may work."""
CONTROL_GROUPS = ("/sys/fs/cgroup/unified", "/sys/fs/cgroup")
UNWANTED = ("systemd-sysctl", "systemd-binfmt", "systemd-modules-load", "systemd-remount-fs",
            "systemd-timesyncd", "networking")  # fmt: skip
MOUNTS = ("dev-hugepages", "dev-mqueue", "sys-fs-fuse-connections", "sys-kernel-config",
          "sys-kernel-debug", "sys-kernel-tracing")  # fmt: skip
TARGET = """[Unit]
Requires=dbus.socket systemd-logind.service
After=dbus.socket systemd-logind.service
AllowIsolate=yes
"""
LOGIND = f"""[Login]
KillUserProcesses=yes
KillExcludeUsers={LINGERS}
UserStopDelaySec=1
"""


class NoBox(Exception):
    """This user, or this system, can have no such computer."""


@contextmanager
def plant_box() -> Iterator[list[str]]:
    """The words before a command that run it there. Raises NoBox."""
    needed = ("unshare", "nsenter", "mount", "runuser", "setpriv", "loginctl", "useradd")
    if missing := [text for text in needed if shutil.which(text) is None]:
        raise NoBox(f"needs {', '.join(missing)}")
    top = next((text for text in CONTROL_GROUPS if Path(text, "cgroup.controllers").exists()), None)
    if os.geteuid() != 0 or top is None or not Path("/lib/systemd/systemd").exists():
        raise NoBox("needs root, systemd and control groups of version 2")
    group = Path(top, f"drivepanel-box-{os.getpid()}")
    with tempfile.TemporaryDirectory(prefix="box") as folder:
        group.mkdir()
        command = ["unshare", *NAMESPACES, sys.executable, "-m", "benchmarks.plant_box", folder]
        outside = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, start_new_session=True,
            preexec_fn=lambda: (group / "cgroup.procs").write_text("0"),
        )  # fmt: skip
        first = 0
        try:
            first = _first_process(outside)
            enter = ["nsenter", "-t", str(first), "-a"]
            _set_up(enter)
            yield enter
        finally:
            for pid in (first, outside.pid):
                with suppress(ProcessLookupError):
                    os.kill(pid or outside.pid, signal.SIGKILL)
            outside.wait()
            _remove(group)


def _first_process(outside: subprocess.Popen[bytes]) -> int:
    end = time.monotonic() + STARTS_WITHIN
    children = Path(f"/proc/{outside.pid}/task/{outside.pid}/children")
    while time.monotonic() < end and outside.poll() is None:
        with suppress(OSError, IndexError):
            first = int(children.read_text().split()[0])
            if Path(f"/proc/{first}/comm").read_text() == "systemd\n":
                enter = ["nsenter", "-t", str(first), "-a"]
                while subprocess.run([*enter, "loginctl"], capture_output=True).returncode:
                    time.sleep(0.2)
                return first
        time.sleep(0.1)
    raise NoBox("systemd does not start in namespaces here")


def _set_up(enter: list[str]) -> None:
    commands = [["groupadd", "-f", GROUP], ["useradd", "-r", "-g", GROUP, "-m", SERVICE]]
    users = (*(f"user{number}" for number in range(USERS)), LINGERS)
    commands += [["useradd", "-m", "-G", GROUP, user] for user in users]
    commands.append(["install", "-d", "-m", "755", PLACE])
    for command in commands:
        subprocess.run([*enter, *command], check=True)


def _remove(group: Path) -> None:
    end = time.monotonic() + ENDS_WITHIN
    while group.exists() and time.monotonic() < end:
        for path in sorted(group.rglob("*/"), reverse=True):
            with suppress(OSError):
                path.rmdir()
        with suppress(OSError):
            group.rmdir()
            return
        time.sleep(0.1)


# Inside


def _mount(*words: str) -> None:
    subprocess.run(["mount", *words], check=True)


def _begin(folder: Path) -> None:
    """Become the first process of that computer; never returns."""
    _mount("--make-rprivate", "/")
    _mount("-t", "tmpfs", "tmpfs", str(folder))
    upper, work, root = (folder / name for name in ("upper", "work", "root"))
    for item in (upper, work, root):
        item.mkdir()
    _mount("-t", "overlay", "overlay", "-o",
           f"lowerdir=/,upperdir={upper},workdir={work}", str(root))  # fmt: skip
    _mount("-t", "proc", "proc", str(root / "proc"))
    _mount("--bind", str(root / "proc/sys"), str(root / "proc/sys"))
    _mount("-o", "remount,bind,ro", str(root / "proc/sys"))
    _mount("-t", "sysfs", "-o", "ro", "sysfs", str(root / "sys"))
    _mount("-t", "cgroup2", "cgroup2", str(root / "sys/fs/cgroup"))
    for name, mode in (("run", "755"), ("tmp", "1777"), ("dev", "755")):
        _mount("-t", "tmpfs", "-o", f"mode={mode}", "tmpfs", str(root / name))
    for name in ("null", "zero", "full", "random", "urandom", "tty"):
        (root / "dev" / name).touch()
        _mount("--bind", f"/dev/{name}", str(root / "dev" / name))
    (root / "dev/pts").mkdir()
    _mount("-t", "devpts", "-o", "newinstance,ptmxmode=0666,mode=620,gid=5", "devpts",
           str(root / "dev/pts"))  # fmt: skip
    (root / "dev/ptmx").symlink_to("pts/ptmx")
    (root / "dev/fd").symlink_to("/proc/self/fd")
    _write_settings(root / "etc")
    for parent in (Path(sys.executable).resolve().parents, ROOT.parents):
        for item in parent:  # every user runs the same Python
            inside = root / item.relative_to("/")
            inside.chmod(inside.stat().st_mode | 0o011)
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    subprocess.run(["hostname", "box"], check=True)
    os.chdir(root)
    Path("old").mkdir()
    subprocess.run(["pivot_root", ".", "old"], check=True)
    subprocess.run(["umount", "-l", "/old"], check=True)
    with open(os.devnull, "r+b") as nothing:
        for descriptor in range(3):
            os.dup2(nothing.fileno(), descriptor)
    words = ["--unit=box.target", "--log-target=journal", "--show-status=0"]
    path = "/usr/sbin:/usr/bin:/sbin:/bin"
    os.execve("/lib/systemd/systemd", ["systemd", *words], {"container": "box", "PATH": path})


def _write_settings(etc: Path) -> None:
    units = etc / "systemd/system"
    for path in units.glob("*.wants"):
        shutil.rmtree(path)
    (units / "box.target").write_text(TARGET)
    (etc / "systemd/logind.conf.d").mkdir(parents=True, exist_ok=True)
    (etc / "systemd/logind.conf.d/box.conf").write_text(LOGIND)
    unwanted = [*(f"{text}.service" for text in UNWANTED), *(f"{mount}.mount" for mount in MOUNTS)]
    for name in unwanted:
        (units / name).unlink(missing_ok=True)
        (units / name).symlink_to(os.devnull)
    (etc / "machine-id").write_text(f"{os.getpid():032x}\n")
    (etc / "fstab").write_text("")


if __name__ == "__main__":
    _begin(Path(sys.argv[1]))
