"""Rounds of `chaos` in which the system itself fails: adapter, processor, disk, package."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from contextlib import suppress
from pathlib import Path

from benchmarks.chaos_line import Stage, processes_of
from benchmarks.chaos_round import DEAD_FROZEN, KILLED, THAWED, Round
from benchmarks.quota import slow_group
from tests.sources import ROOT

End = tuple[float, float | None, bool]
TYPED = "typed"
"""A `stop` in a shell ends the round of the program that runs the motor."""
SLOW, SLOW_DISK = 10.0, 4.0
"""Seconds that a stop may take on a slow computer, and for which a disk accepts nothing."""


class _Altered(Round):
    """A round whose system changes just before the end; `suffix` names that in the kind."""

    suffix = ""

    def _begin(self) -> None:
        self._end = self._end.removesuffix(self.suffix)
        super()._begin()

    def _end_victim(self) -> End:
        self._alter()
        if self._outcome.program != "stop":
            return super()._end_victim()
        begun = time.time()
        self._stop()
        return begun, 1.0, False

    def _alter(self) -> None:
        """Change the system."""

    def _stop(self) -> None:
        self._stage.start("stop", "LINE", "-d", "1", "-p", "atv71")


class Unplugged(_Altered):
    """The adapter is unplugged, and plugged in again.

    The motor is allowed to run on if its drive did not trip in that time: `run` and the panel
    command it again, and the end of the program must stop it.
    """

    def _end_victim(self) -> End:
        pause = self._chance.uniform(0.2, 8.0)
        self._stage.line.plug(plugged=False)
        time.sleep(pause)
        self._stage.line.plug(plugged=True)
        return time.time(), None, False


class Quota(_Altered):
    """All programs together get a tenth of a processor."""

    suffix = ", CPU quota 10 %"

    def play(self) -> None:
        """Play it, if this user may limit the processor."""
        with slow_group(f"chaos-{self._outcome.number}") as self._group:
            if self._group is None:
                self._outcome.failed = "needs root, to limit the processor"
                return
            self._slack += SLOW
            super().play()

    def _end_victim(self) -> End:
        begun, due, must_run = super()._end_victim()
        # programs that come back to the next keeper after 2 s have lost their motors
        return begun, due, must_run and self._outcome.program != "keeper"

    def _alter(self) -> None:
        assert self._group is not None
        for pid in processes_of(self._stage.folder):
            with suppress(OSError):
                (self._group / "cgroup.procs").write_text(str(pid))

    def _stop(self) -> None:
        super()._stop()
        self._alter()


class _DiskStage(Stage):
    """A line whose programs keep their state on a disk of its own."""

    def __init__(self, baud: int) -> None:
        super().__init__(baud)
        image = self.folder / "disk"
        with image.open("wb") as file:
            file.truncate(1 << 24)
        subprocess.run(["mkfs.ext4", "-q", str(image)], check=True)
        self.state.mkdir()
        subprocess.run(["mount", "-o", "loop", str(image), str(self.state)], check=True)

    def freeze(self, *, frozen: bool) -> None:
        """Let the disk write nothing, or let it write again."""
        command = ["fsfreeze", "-f" if frozen else "-u", str(self.state)]
        subprocess.run(command, check=frozen, stderr=subprocess.DEVNULL)

    def close(self) -> None:
        """End whatever is there yet; the disk goes with it."""
        self.freeze(frozen=False)
        subprocess.run(["umount", "--lazy", str(self.state)], check=False)
        super().close()


class SlowDisk(_Altered):
    """Block the disk until the round is judged, or for seconds if a keeper is to start."""

    suffix = ", disk stalls"
    stage_of = _DiskStage

    def _alter(self) -> None:
        assert isinstance(self._stage, _DiskStage)
        self._stage.freeze(frozen=True)

    def _end_victim(self) -> End:
        ended = super()._end_victim()
        if self._outcome.program != "keeper":
            return ended
        # the next keeper has to write its lock first; the drive may trip until then
        time.sleep(self._chance.uniform(0.5, SLOW_DISK))
        self._thaw()
        return ended[0], None, False

    def _end_all(self) -> None:
        self._thaw()
        super()._end_all()

    def _thaw(self) -> None:
        assert isinstance(self._stage, _DiskStage)
        self._stage.freeze(frozen=False)


class _CopyStage(Stage):
    """A line whose programs run from a package of their own."""

    def __init__(self, baud: int) -> None:
        super().__init__(baud)
        self.package = self.folder / "package"
        for name in ("tui", "profiles"):
            shutil.copytree(ROOT / name, self.package / name)
        self.environment |= {"PYTHONPATH": str(self.package), "PYTHONSAFEPATH": "1"}


class Upgraded(_Altered):
    """The package is removed, or replaced by one whose messages have another version."""

    suffix = ", package removed"
    stage_of = _CopyStage

    def _alter(self) -> None:
        assert isinstance(self._stage, _CopyStage)
        package = self._stage.package
        package.rename(package.with_name("before"))
        shutil.rmtree(package.with_name("before"))
        (package / "tui").mkdir(parents=True)
        (package / "tui/__init__.py").touch()  # or that of the checkout would take its place
        if "replaced" in self.suffix:
            for name in ("tui", "profiles"):
                shutil.copytree(ROOT / name, package / name, dirs_exist_ok=True)
            change_version(package)
        if self._outcome.program == "stop":
            self._stage.environment["PYTHONPATH"] = str(ROOT)


class Replaced(Upgraded):
    """The package is replaced; a keeper that is started now has another version, and ends."""

    suffix = ", package replaced"


def change_version(package: Path) -> None:
    """Give the messages of a package the next version."""
    file = package / "tui/bus/share/messages.py"
    text = file.read_text("utf-8")
    file.write_text(re.sub(r"^VERSION = (\d+)", lambda v: f"VERSION = {int(v[1]) + 1}", text,
                           flags=re.MULTILINE), "utf-8")  # fmt: skip


SYSTEM_ROUNDS: dict[tuple[str, str], type[Round]] = {
    ("run", "adapter unplugged"): Unplugged,
    ("panel", "adapter unplugged"): Unplugged,
    **{(program, end + made.suffix): made
       for made in (Quota, SlowDisk)
       for program, end in (("run", KILLED), ("run", "Ctrl-C"), ("keeper", KILLED),
                            ("keeper", THAWED), ("stop", TYPED))},
    **{(program, end + Upgraded.suffix): Upgraded
       for program, end in (("run", KILLED), ("run", "Ctrl-C"), ("run", DEAD_FROZEN),
                            ("panel", KILLED), ("stop", TYPED))},
    **{(program, end + Replaced.suffix): Replaced
       for program, end in (("run", KILLED), ("keeper", KILLED), ("stop", TYPED))},
}  # fmt: skip
"""Program and end, and what plays it."""
