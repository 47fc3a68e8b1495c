"""Profiles loaded by several threads at once, as by a scan and a stop."""

from __future__ import annotations

import subprocess
import sys

from tests.programs import PATIENCE

PROGRAM = """
import sys, threading
sys.setswitchinterval(1e-6)
from tui.drive.profile import library, stop_profile
ids = [listing.id for listing in library.listings()]
start = threading.Barrier(len(ids) + 1)
def load(id):
    start.wait()
    library.load(id)
threads = [threading.Thread(target=load, args=(id,)) for id in ids]
for thread in threads:
    thread.start()
start.wait()
for listing in library.listings():
    stop_profile._quick(listing.path)
for thread in threads:
    thread.join()
print(len({library.load(id).id for id in ids}))
"""


def test_concurrent_first_use_of_a_profile_is_safe() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=PATIENCE
    )
    assert (done.returncode, done.stdout.strip()) == (0, "7"), done.stderr
