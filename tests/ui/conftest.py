"""What the tests of the screens start from."""

from __future__ import annotations

import pytest

from tui.screens.dialogs.question import Question


@pytest.fixture(autouse=True)
def quick_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Questions take an answer as soon as they stand; `test_questions` looks at the waiting."""
    monkeypatch.setattr(Question, "_is_early", lambda _: False)
