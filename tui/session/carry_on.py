"""Steps of a stop whose errors must not prevent it."""

from __future__ import annotations

import logging
from collections.abc import Callable

from tui.bus.errors import LineClosed

log = logging.getLogger(__name__)


def carried_on(step: Callable[[], object]) -> None:
    """Carry out a step of a stop; log an internal error in it. Raises LineClosed."""
    try:
        step()
    except LineClosed:
        raise
    except Exception:
        # the log may be what has failed
        try:
            log.exception("an internal error on the way of a stop")
        except Exception:
            return
