"""A journal that cannot be written is said at once, and keeps no command from ending well."""

from __future__ import annotations

import os
from pathlib import Path

from .commands import invoked


def test_a_write_whose_journal_cannot_be_kept_is_done_and_told() -> None:
    state = Path(os.environ["DRIVEPANEL_STATE"])
    state.parent.mkdir(parents=True, exist_ok=True)
    state.write_text("a file where the folder should be")
    done = invoked("write", "sim:atv71@1", "ACC=4.0", "--arm")
    assert done.exit_code == 0, done.stderr
    assert "The journal cannot be written" in done.stderr
