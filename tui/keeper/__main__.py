"""`python -m tui.keeper`: started by the first program on a line, never by a person."""

from __future__ import annotations

from .process import main

if __name__ == "__main__":
    main()
