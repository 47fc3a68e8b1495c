"""Upload of all parameters of a drive into a parameter set, at background priority."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import datetime

import tui
from tui.bus.api import Priority
from tui.drive.profile.profile import Profile
from tui.drive.settings.parameter_set import ParameterSet, SetHead
from tui.drive.settings.rating import rating_codes
from tui.drive.settings.writable import is_setting
from tui.drive.shown import scale_sources

from ..drive import DriveSession
from .retrying_reader import RetryingReader, neighbors

ReadProgress = Callable[[int, int], None]
"""Called with the number of parameters read or refused so far, and the total."""


def readable_codes(profile: Profile) -> list[str]:
    """Return the codes of all readable parameters, in the profile's order."""
    return [p.code for p in profile.parameters if p.access != "w"]


def setting_codes(profile: Profile) -> list[str]:
    """Return the codes of all settings, scale sources and ratings, in the profile's order."""
    wanted = set(scale_sources(profile)) | set(rating_codes(profile))
    return [
        p.code
        for p in profile.parameters
        if p.access != "w" and (is_setting(profile, p) or p.code in wanted)
    ]


@dataclass(slots=True)
class Upload:
    """Reads each parameter once; after a line error, `run` continues with the rest."""

    session: DriveSession
    codes: list[str] = field(default_factory=list)
    """Codes to read; every readable parameter if empty."""
    progress: ReadProgress | None = None
    priority: Priority = Priority.BACKGROUND
    raws: dict[str, int] = field(default_factory=dict)
    """Values read so far."""
    absent: dict[str, str] = field(default_factory=dict)
    """Refusal or error by code, for parameters without a value."""
    retrying: RetryingReader = field(init=False)

    def __post_init__(self) -> None:
        self.codes = self.codes or readable_codes(self.session.profile)
        self.retrying = RetryingReader(self.session, self.priority)

    @property
    def left(self) -> list[str]:
        """Codes neither read nor refused yet."""
        return [c for c in self.codes if c not in self.raws and c not in self.absent]

    @property
    def done(self) -> bool:
        """True if every parameter was read or refused."""
        return not self.left

    async def run(self) -> None:
        """Read the parameters left, scale sources first.

        Raises the line's errors; values read so far stay, and another call reads the rest.
        """
        profile = self.session.profile
        sources = scale_sources(profile)
        first = [code for code in self.left if code in sources]
        for codes in (first, *neighbors(profile, self.left)):
            for group in self.retrying.reader.groups(codes):
                await self._ask(group)
            # refused codes are in no group
            await self._ask(codes)

    async def _ask(self, codes: Iterable[str]) -> None:
        wanted = [code for code in codes if code not in self.raws and code not in self.absent]
        if not wanted:
            return
        for code, reading in (await self.retrying.ask(wanted)).items():
            if reading.raw is None:
                self.absent[code] = reading.error
            else:
                self.raws[code] = reading.raw
        self._tell()

    def _tell(self) -> None:
        if self.progress is not None:
            self.progress(len(self.codes) - len(self.left), len(self.codes))

    def parameter_set(self) -> ParameterSet:
        """Return the values read so far, with their origin."""
        wanted = set(self.codes)
        return ParameterSet(
            head=head_of(self.session),
            raws={code: raw for code, raw in self.raws.items() if code in wanted},
            absent={code: why for code, why in self.absent.items() if code in wanted},
        )


def head_of(session: DriveSession) -> SetHead:
    """Create the head of a parameter set of this drive, with the current time."""
    profile, identity = session.profile, session.identity
    message = {}
    if identity is not None:
        message = {
            "vendor": identity.vendor,
            "reference": identity.reference,
            "version": identity.version_text,
            "name": identity.name,
        }
    return SetHead(
        profile=profile.id,
        profile_version=profile.data.profile.version,
        family=profile.name,
        time=datetime.fromtimestamp(session.clock.wall())
        .astimezone()
        .isoformat(timespec="seconds"),
        line=session.line_text,
        device=session.device,
        panel=tui.__version__,
        identity={key: text for key, text in message.items() if text},
    )
