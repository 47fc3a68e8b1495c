"""Stop frames of a drive, made when it is opened so that no later error prevents a stop."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from tui.bus.api import ModbusLine
from tui.bus.prepared import PreparedWrite, prepared_write
from tui.drive.first_stop import blind_stops
from tui.drive.profile.profile import Profile
from tui.drive.profile.stop_profile import stop_profile_of

from .limits import limits_of

log = logging.getLogger(__name__)


def prepared_stop(
    line: ModbusLine, device: int, families: Sequence[Profile]
) -> tuple[PreparedWrite, ...]:
    """Prepare the words that stop a drive of any of these families in any of their charts.

    Empty if there is no such word; an error must not keep a drive from being opened.
    """
    try:
        words = blind_stops([stop_profile_of(family) for family in families])
        limits = limits_of(families[0])
        return tuple(
            prepared_write(line.link, limits, device, word.address, word.values) for word in words
        )
    except Exception:
        log.exception("no stop is prepared for device %s", device)
        return ()
