"""Start a program of Drive Panel in another place: `python -m benchmarks.in_place PLACE USER ...`.

PLACE is `session` (a log-in of USER), `logout` (the same, which ends without the program), `user`
or `namespace` (of processes; USER is unused). The rest are the program's arguments.
"""

from __future__ import annotations

import os
import pwd
import shlex
import sys
from pathlib import Path

from benchmarks.chaos_line import ROUND_SETTING
from tests.programs import DRIVEPANEL

LOGGED_IN, LEFT_ALONE = "logged-in", "left-alone"
"""Files in the folder of the round. The login lasts while the first exists; the other has the id of
its program.
"""
KEPT = (ROUND_SETTING, "DRIVEPANEL_SHARE_GROUP", "DRIVEPANEL_SHARE_FOLDER", "PYTHONPATH",
        "DRIVEPANEL_STATE", "DRIVEPANEL_CONFIG", "TERM", "LC_ALL")  # fmt: skip


def words_in(place: str, user: str, command: list[str], folder: Path) -> list[str]:
    """The words that start a command there; its settings are in the environment."""
    if place == "namespace":
        return ["unshare", "-fp", "--mount-proc", "--kill-child", *command]
    found = pwd.getpwnam(user)
    state = folder / f"state-{user}"
    if not state.exists():
        state.mkdir()
        os.chown(state, found.pw_uid, found.pw_gid)
    os.environ |= {"DRIVEPANEL_STATE": str(state), "DRIVEPANEL_CONFIG": str(state)}
    if place == "user":
        os.environ.pop("XDG_RUNTIME_DIR", None)
        numbers = f"--reuid={found.pw_uid}", f"--regid={found.pw_gid}"
        return ["setpriv", *numbers, "--init-groups", *command]
    kept = [f"{name}={os.environ[name]}" for name in KEPT if name in os.environ]
    text = shlex.join(["env", *kept, *command])
    if place == "logout":
        (folder / LOGGED_IN).touch()
        alone = shlex.quote(str(state / LEFT_ALONE))
        here = shlex.quote(str(folder / LOGGED_IN))
        text = f"{text} & echo $! > {alone}; while [ -e {here} ]; do sleep 0.1; done"
    else:
        text = f"exec {text}"
    return ["runuser", "-l", user, "--session-command", text]


def main() -> None:
    place, user, *arguments = sys.argv[1:]
    folder = Path(os.environ[ROUND_SETTING])
    words = words_in(place, user, [*DRIVEPANEL, *arguments], folder)
    os.execvp(words[0], words)


if __name__ == "__main__":
    main()
