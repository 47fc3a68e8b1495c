"""Files that Parameters asks for: which question, which text, which codes."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tui.screens.dialogs.ask import Ask
from tui.screens.parameters.set_keys import SetKeys

ABOUT_BACKUP = "Every setting, in units and raw, one per line (TOML)."


def test_backup_has_the_settings_and_a_report_everything() -> None:
    requests: list[tuple[object, ...]] = []
    session = SimpleNamespace(profile=None, device=7)
    here: Any = SimpleNamespace(
        _ask_for_file=lambda *of: requests.append(of), _set_text="text", _setting_codes=["ACC"],
        session=session,
        app=SimpleNamespace(line_text="", opened=None, clock=SimpleNamespace(wall=lambda: 0.0)),
    )  # fmt: skip
    SetKeys.action_save_file(here)
    SetKeys.action_report(here)
    backup, (question, suffix, about, text, codes) = requests
    assert backup == ("Back up to", "toml", ABOUT_BACKUP, "text", ["ACC"])
    assert (question, suffix, codes) == ("Report to", "md", [])
    assert callable(text)
    assert ".html or .txt: one page for the customer." in str(about)


@pytest.mark.parametrize(("name", "reads"), [(None, 0), ("", 0), ("~/a.toml", 1)])
def test_only_a_named_file_is_read_for(name: str | None, reads: int) -> None:
    pushed: list[tuple[Ask, Any]] = []
    works: list[tuple[object, ...]] = []
    here: Any = SimpleNamespace(
        _new_path=lambda suffix: Path(f"new.{suffix}"),
        _read_to_file=lambda *of: of,
        run_worker=lambda work, **how: works.append((work, how)),
        app=SimpleNamespace(push_screen=lambda *of: pushed.append(of)),
    )
    SetKeys._ask_for_file(here, "Back up to", "toml", ABOUT_BACKUP, str, ["ACC"])  # type: ignore[arg-type]
    ((requested, reported),) = pushed
    given = vars(requested)
    assert {"Back up to", "new.toml", ABOUT_BACKUP, "Save"} <= set(map(str, given.values()))
    reported(name)
    path = Path("~/a.toml").expanduser()
    assert works == [((path, str, ["ACC"]), {"exclusive": True, "group": "sets"})] * reads
