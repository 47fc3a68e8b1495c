"""The log file in the state folder."""

from __future__ import annotations

import logging
from logging.handlers import RotatingFileHandler
from pathlib import Path

from tui.session.state import state_folder

PANEL = "tui"
"""The logger above all others of the panel: each module logs to one by its own name."""
LEVELS = (logging.INFO, logging.DEBUG)


def log_file() -> Path:
    """Where the log is."""
    return state_folder() / "drivepanel.log"


def start_logging(verbose: int) -> None:
    """Log to the file; with more `-v` in more detail. Without a writable folder, not at all."""
    logger = logging.getLogger(PANEL)
    logger.setLevel(LEVELS[min(verbose, len(LEVELS) - 1)])
    try:
        log_file().parent.mkdir(parents=True, exist_ok=True)
        handler: logging.Handler = RotatingFileHandler(
            log_file(), maxBytes=1_000_000, backupCount=3, encoding="utf-8", delay=True
        )
    except OSError:
        handler = logging.NullHandler()
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    stop_logging()
    logger.addHandler(handler)
    logger.propagate = False


def stop_logging() -> None:
    """Close the log."""
    logger = logging.getLogger(PANEL)
    for handler in list(logger.handlers):
        logger.removeHandler(handler)
        handler.close()
    logger.propagate = True
