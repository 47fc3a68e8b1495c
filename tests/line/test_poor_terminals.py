"""Whatever a terminal lacks, its stop keys stop."""

from __future__ import annotations

import pytest

from tests.sweeps import kept

from .pty_panel import panel_on_a_pty

TERMINALS: dict[str, tuple[tuple[str, ...], dict[str, str], tuple[int, int]]] = {
    "no UTF-8": ((), {"LC_ALL": "C"}, (80, 24)),
    "Latin-1": ((), {"LC_ALL": "en_US.ISO-8859-1"}, (80, 24)),
    "--ascii": (("--ascii",), {}, (80, 24)),
    "dumb": ((), {"TERM": "dumb"}, (80, 24)),
    "vt100": ((), {"TERM": "vt100"}, (80, 24)),
    "NO_COLOR": ((), {"NO_COLOR": "1"}, (80, 24)),
    "sixteen colors": ((), {"TERM": "linux"}, (80, 24)),
    "60x16": ((), {}, (60, 16)),
    "too small": ((), {}, (40, 12)),
    "much too small": ((), {}, (12, 3)),
}
STOP_KEYS = ("\x1b[24~", "\x1bO[", "\x1b[X", "\x9b24~", "\x1b[20~", "\x1bOX", "\x1b[U", " ")
"""F12 and F9 in the dialects of terminals, and Space."""


@pytest.mark.parametrize("name", kept(TERMINALS, "no UTF-8", "dumb", "60x16", "much too small"))
def test_stop_keys_stop_on_a_poor_terminal(name: str) -> None:
    options, environment, size = TERMINALS[name]
    with panel_on_a_pty(*options, size=size, environment=environment) as panel:
        for key in STOP_KEYS:
            panel.settle(0.2)
            before = len(panel.log.writes)
            panel.type(key)
            panel.stopped(before, 0.3)


@pytest.mark.parametrize("name", ["too small", "much too small"])
def test_only_stop_keys_work_on_a_too_small_terminal(name: str) -> None:
    options, environment, size = TERMINALS[name]
    with panel_on_a_pty(*options, size=size, environment=environment) as panel:
        for key in ("a", "r", "3", "0", "\r", "y", "k", "e", "z", "y", "w", "q", "y"):
            panel.type(key)
            panel.settle(0.4)
        assert panel.log.writes == []
        assert panel.look(), "the panel is there"
