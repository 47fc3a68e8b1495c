"""A driver whose terminal may keep typed keys to itself after the screen was left."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from textual.driver import Driver


def with_held_input(driver: type[Driver]) -> type[Driver]:
    """Let a driver leave the screen without giving the terminal its attributes back."""

    class HoldingDriver(driver):  # type: ignore[valid-type, misc]
        """Restores the terminal's attributes with the screen, or later if they are held."""

        def __init__(self, app: Any, **settings: Any) -> None:
            self._held = False
            self._attributes: list[Any] | None = None
            super().__init__(app, **settings)

        def start_application_mode(self) -> None:
            """Take the terminal."""
            super().start_application_mode()
            # Textual would restore them together with the screen
            self._attributes, self.attrs_before = getattr(self, "attrs_before", None), None

        def stop_application_mode(self) -> None:
            """Leave the screen; unless it is held, release the input too."""
            try:
                super().stop_application_mode()
            finally:
                if not self._held:
                    self.release_input()

        def hold_input(self) -> None:
            """Keep typed keys without echo and signals until `release_input`; in any thread."""
            self._held = True

        def release_input(self) -> None:
            """Discard typed keys, then restore the terminal's attributes; in any thread."""
            self._held = False
            before, self._attributes = self._attributes, None
            if before is None:
                return
            import termios

            with suppress(termios.error):
                termios.tcflush(self.fileno, termios.TCIFLUSH)
                termios.tcsetattr(self.fileno, termios.TCSANOW, before)

        def close(self) -> None:
            """End all writing; while the input is held, there is more to write."""
            if not self._held:
                super().close()

    return HoldingDriver
