"""A separate terminal for a program: a private tmux."""

from __future__ import annotations

import subprocess
import time
from dataclasses import dataclass

from tests.programs import PATIENCE, wait_until

A_MOMENT = 0.4
"""Seconds, longer than a question ignores answers."""


@dataclass(frozen=True, slots=True)
class Terminal:
    """An 80 x 24 terminal in tmux."""

    tmux: tuple[str, ...]

    def run(self, *arguments: str) -> str:
        """Run a tmux command on it; return its output."""
        done = subprocess.run(
            [*self.tmux, *arguments],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=True,
        )
        return done.stdout

    def text(self) -> str:
        """Text on the terminal."""
        return self.run("capture-pane", "-p")

    def press(self, *keys: str) -> None:
        """Press keys, by tmux's names."""
        self.run("send-keys", *keys)

    def answer(self, key: str, question: str = "") -> None:
        """Press a key that answers a visible question, late enough to count.

        With the words of the question, press it again if the panel has ignored it: it ignores a
        key that a busy computer brings too late, as after a pause of the panel.
        """
        while True:
            time.sleep(A_MOMENT)
            self.press(key)
            if not question:
                return
            wait_until(lambda: self._is_settled(question), f"an effect of {key}")
            if question not in self.text():
                return

    def press_for(self, key: str, *words: str) -> None:
        """Press a key and wait for its effect; press it again if the panel has ignored it."""

        def shown() -> bool:
            return all(word in self.text() for word in words)

        while not shown():
            self.press(key)
            wait_until(lambda: shown() or self._has_ignored(), f"an effect of {key}")
            time.sleep(A_MOMENT)

    def _has_ignored(self) -> bool:
        text = self.text()
        return "Ignored a key" in text or "Key ignored" in text

    def _is_settled(self, question: str) -> bool:
        """True if a question is closed, or the panel reports that it has ignored a key."""
        return question not in self.text() or self._has_ignored()

    def wait_for(self, *words: str) -> None:
        """Wait until all the words are on it."""
        try:
            wait_until(lambda: all(word in self.text() for word in words), f"{words} on screen")
        except AssertionError as late:
            raise AssertionError(f"{late}; the screen:\n{self.text()}") from None

    def wait_for_end(self) -> None:
        """Wait until the program in it has ended; the text of tmux about that may be missing."""
        wait_until(lambda: self.run("list-panes", "-F", "#{pane_dead}") == "1\n", "its end")

    def client(self) -> int:
        """Process id of the program in it: the SSH client."""
        return int(self.run("display-message", "-p", "#{pane_pid}"))
